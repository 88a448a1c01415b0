#include "bracket.h"

#include <algorithm>
#include <cmath>

#include "gonio/instrument/measurement_equation.h"
#include "light_watch.h"
#include "standing_capture.h"

namespace gonio::acquisition {
namespace {

std::vector<RegionReading> read_regions(const devices::Frame& frame, const Regions& regions,
                                        const instrument::ResponseCurve& response) {
  std::vector<RegionReading> readings;
  for (const auto& region : regions) {
    RegionReading reading;
    double sum = 0.0;
    for (const std::size_t pixel : region) {
      const double dn = frame.pixels_dn[pixel];
      sum += response.linear_dn(dn - frame.black_level_dn);
      reading.maximum_dn = std::max(reading.maximum_dn, dn);
    }
    reading.pixels = static_cast<double>(region.size());
    reading.mean_dn = sum / reading.pixels;
    readings.push_back(reading);
  }
  return readings;
}

}  // namespace

Regions regions_of(const instrument::Instrument& instrument, const rig::RigPose& pose,
                   const Eigen::Vector2d& centre_mm, double half_width_mm, int grid) {
  Regions regions(static_cast<std::size_t>(grid * grid));
  const int width = instrument.camera.width_px;
  const std::vector<std::uint8_t> bad =
      instrument::bad_pixel_mask(instrument.sensor, width, instrument.camera.height_px);
  for (int row = 0; row < instrument.camera.height_px; ++row) {
    for (int column = 0; column < width; ++column) {
      const std::size_t pixel = static_cast<std::size_t>(row) * static_cast<std::size_t>(width) +
                                static_cast<std::size_t>(column);
      if (bad[pixel] != 0) continue;
      const auto geometry = instrument::pixel_geometry(instrument, pose, column, row);
      if (!geometry) continue;
      const Eigen::Vector2d place =
          (geometry->point_in_sample_mm.head<2>() - centre_mm) / half_width_mm;
      if (place.cwiseAbs().maxCoeff() >= 1.0) continue;
      const auto index = [&](double coordinate) {
        // Rounding may carry a coordinate just below 1 over the last border.
        return std::min(grid - 1, static_cast<int>((coordinate + 1.0) / 2.0 * grid));
      };
      regions[static_cast<std::size_t>(index(place.y()) * grid + index(place.x()))].push_back(
          pixel);
    }
  }
  std::erase_if(regions, [](const auto& region) { return region.empty(); });
  return regions;
}

BracketResult take_bracket(GuardedDevices& devices, const instrument::Instrument& instrument,
                           const SessionOptions& options, const Regions& regions,
                           std::chrono::nanoseconds first_exposure, const FrameRecord& record,
                           SessionWriter& archive) {
  LightWatch light(devices);
  const auto expose = [&](std::chrono::nanoseconds exposure) {
    FrameRecord own = record;
    const devices::Frame frame =
        capture_standing(devices, exposure, own, [&] { light.during(exposure); });
    own.monitor = light.read();
    archive.append(std::move(own), frame);
    return read_regions(frame, regions, instrument.sensor.response);
  };
  BracketResult result = bracket_exposures(
      instrument.sensor, options, devices.devices().camera->info(), first_exposure, expose);
  result.lowest_monitor = light.lowest();
  result.highest_monitor = light.highest();
  return result;
}

}  // namespace gonio::acquisition
