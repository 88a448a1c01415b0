#include "expected_regions.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "gonio/instrument/measurement_equation.h"

namespace gonio::acquisition {
namespace {

/// Places per region and direction, its borders included: highlights are narrow.
constexpr int kPlaces = 4;

/// Share of a sensor's pixels that have a colour, and what such pixels take of the three bands.
struct PixelColour {
  double share = 1.0;
  brdf::Rgb uptake = brdf::Rgb::Ones();
};

std::vector<PixelColour> colours_of(devices::PixelFormat format) {
  if (format == devices::PixelFormat::mono) return {PixelColour{}};
  return {{0.25, {1.0, 0.0, 0.0}}, {0.5, {0.0, 1.0, 0.0}}, {0.25, {0.0, 0.0, 1.0}}};
}

/// Pixels per square millimetre of the sample plane around a point.
double pixel_density(const instrument::Instrument& instrument, const rig::RigPose& pose,
                     const Eigen::Vector2d& place_mm) {
  constexpr double kStep_mm = 0.5;
  const auto pixel = [&](double dx, double dy) {
    return instrument::pixel_of_point(instrument, pose,
                                      {place_mm.x() + dx, place_mm.y() + dy, 0.0});
  };
  const auto here = pixel(0.0, 0.0);
  const auto right = pixel(kStep_mm, 0.0);
  const auto up = pixel(0.0, kStep_mm);
  if (!here || !right || !up) return 0.0;
  const Eigen::Vector2d a = (*right - *here) / kStep_mm;
  const Eigen::Vector2d b = (*up - *here) / kStep_mm;
  return std::abs(a.x() * b.y() - a.y() * b.x());
}

bool in_frame(const instrument::CameraModel& camera, const Eigen::Vector2d& pixel) {
  return pixel.x() >= -0.5 && pixel.y() >= -0.5 && pixel.x() <= camera.width_px - 0.5 &&
         pixel.y() <= camera.height_px - 0.5;
}

}  // namespace

TargetSquare white_square(const SessionOptions& options) {
  if (options.white == WhitePlacement::in_frame) {
    return {options.white_patch_mm, options.white_patch_half_width_mm, 1};
  }
  return {Eigen::Vector2d::Zero(),
          options.white_half_width_mm.value_or(options.sample_half_width_mm), 3};
}

std::vector<std::vector<ExpectedRegion>> expected_regions(
    const instrument::Instrument& instrument, const rig::RigPose& pose, const TargetSquare& square,
    devices::PixelFormat format, const ExpectedLight& light,
    const std::function<brdf::Rgb(const brdf::DirectionPair&)>& brdf) {
  const std::vector<PixelColour> colours = colours_of(format);
  std::vector<std::vector<ExpectedRegion>> channels(light.channels.size());
  const double side_mm = 2.0 * square.half_width_mm / square.grid;
  for (int region = 0; region < square.grid * square.grid; ++region) {
    const Eigen::Vector2d corner =
        square.centre_mm - Eigen::Vector2d::Constant(square.half_width_mm) +
        side_mm * Eigen::Vector2d(region % square.grid, region / square.grid);
    const double density =
        pixel_density(instrument, pose, corner + Eigen::Vector2d::Constant(0.5 * side_mm));
    std::vector<ExpectedRegion> found(light.channels.size());
    int seen = 0;
    for (int place = 0; place < kPlaces * kPlaces; ++place) {
      const Eigen::Vector2d at =
          corner + side_mm / (kPlaces - 1) * Eigen::Vector2d(place % kPlaces, place / kPlaces);
      const auto pixel = instrument::pixel_of_point(instrument, pose, {at.x(), at.y(), 0.0});
      if (!pixel || !in_frame(instrument.camera, *pixel)) continue;
      const auto geometry = instrument::pixel_geometry(instrument, pose, pixel->x(), pixel->y());
      if (!geometry) continue;
      ++seen;
      const brdf::Rgb f = brdf(geometry->directions);
      for (std::size_t channel = 0; channel < found.size(); ++channel) {
        for (const PixelColour& colour : colours) {
          const brdf::Rgb constant = light.channels[channel].constant * colour.uptake;
          const double rate = (constant * f).sum() * geometry->factor +
                              constant.sum() * instrument.stray.fraction * geometry->stray_factor;
          found[channel].mean_dn_per_s += colour.share * rate;
          found[channel].maximum_dn_per_s = std::max(found[channel].maximum_dn_per_s, rate);
        }
      }
    }
    const double pixels = density * side_mm * side_mm * seen / (kPlaces * kPlaces);
    if (seen == 0 || pixels < 1.0) continue;
    for (std::size_t channel = 0; channel < found.size(); ++channel) {
      found[channel].mean_dn_per_s /= seen;
      found[channel].pixels = pixels;
      channels[channel].push_back(found[channel]);
    }
  }
  return channels;
}

}  // namespace gonio::acquisition
