#include "camera.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <span>

namespace gonio::sim {

using devices::DeviceErrc;
using devices::DeviceError;
using devices::PixelFormat;
using Time = devices::Clock::Duration;

namespace {

// Motion during an exposure: one picture per so much travel, within bounds of cost.
constexpr double kBlurStepDeg = 0.1;
constexpr int kMaxBlurSteps = 32;

/// Colour (0 R, 1 G, 2 B) of a pixel of a Bayer sensor.
int bayer_colour(PixelFormat format, std::size_t row, std::size_t column) {
  // The four pixels of the top left square in reading order.
  constexpr std::array<int, 4> kRggb{0, 1, 1, 2};
  constexpr std::array<int, 4> kGrbg{1, 0, 2, 1};
  constexpr std::array<int, 4> kGbrg{1, 2, 0, 1};
  constexpr std::array<int, 4> kBggr{2, 1, 1, 0};
  const std::size_t place = 2 * (row % 2) + column % 2;
  switch (format) {
    case PixelFormat::bayer_rggb:
      return kRggb[place];
    case PixelFormat::bayer_grbg:
      return kGrbg[place];
    case PixelFormat::bayer_gbrg:
      return kGbrg[place];
    case PixelFormat::bayer_bggr:
      return kBggr[place];
    case PixelFormat::mono:
      break;
  }
  return 0;
}

}  // namespace

SimCamera::SimCamera(const SimOptions& options, const CameraView& view)
    : options_(options.camera),
      lamp_(options.lamp),
      ambient_radiance_(options.scene.ambient_radiance),
      ambient_steps_(options.scene.ambient_steps),
      view_(view),
      renderer_(options),
      sensor_(options.camera, options.seed, options.noise_seed.value_or(options.seed)) {}

devices::CameraInfo SimCamera::info() const {
  devices::CameraInfo info;
  info.model = options_.model;
  info.serial = options_.serial;
  info.width_px = options_.width_px;
  info.height_px = options_.height_px;
  info.pixel_format = options_.pixel_format;
  info.saturation_level_dn = sensor_.saturation_level_dn();
  info.min_exposure = options_.min_exposure;
  info.max_exposure = options_.max_exposure;
  info.readout = options_.readout;
  return info;
}

devices::Frame SimCamera::capture(std::chrono::nanoseconds exposure,
                                  const std::function<void()>& meanwhile) {
  if (exposure < options_.min_exposure || exposure > options_.max_exposure) {
    throw DeviceError(
        DeviceErrc::LimitViolation, name_,
        fmt::format("exposure {} us, limits {} .. {} us", exposure.count() / 1000,
                    options_.min_exposure.count() / 1000, options_.max_exposure.count() / 1000));
  }
  const auto step = options_.exposure_step.count();
  const std::chrono::nanoseconds applied((exposure.count() + step / 2) / step * step);

  devices::Frame frame;
  frame.width_px = options_.width_px;
  frame.height_px = options_.height_px;
  frame.pixel_format = options_.pixel_format;
  frame.saturation_level_dn = sensor_.saturation_level_dn();
  frame.black_level_dn = options_.black_level_dn;
  frame.exposure = std::clamp(applied, options_.min_exposure, options_.max_exposure);
  frame.exposure_start = view_.clock.now();
  frame.frame_id = next_frame_++;
  const std::uint64_t noise = next_noise_++;

  const std::chrono::nanoseconds open = frame.exposure + options_.shutter_offset;
  const Time end = frame.exposure_start + open;
  const int lit = view_.light.lit();
  // What axes at rest will have shown is known now: in a world that runs by itself it is computed
  // while the exposure lasts, and once more should one of them have been started meanwhile.
  const bool foreseen = at_rest_during(frame.exposure_start, end);
  if (foreseen) frame.pixels_dn = picture(frame.exposure_start, end, lit, noise);
  meanwhile();
  view_.clock.wait_until(frame.exposure_start + frame.exposure + options_.readout);
  if (!foreseen || !at_rest_during(frame.exposure_start, end))
    frame.pixels_dn = picture(frame.exposure_start, end, lit, noise);
  return frame;
}

void SimCamera::count_noise_from(std::uint64_t index) { next_noise_ = index; }

bool SimCamera::at_rest_during(Time start, Time end) const {
  return std::all_of(
      view_.joints.begin(), view_.joints.end(),
      [&](const std::unique_ptr<Joint>& joint) { return joint->at_rest_during(start, end); });
}

double SimCamera::ambient_at(Time time) const {
  double radiance = ambient_radiance_;
  for (const AmbientStep& step : ambient_steps_) {
    if (step.at <= time) radiance = step.radiance;
  }
  return radiance;
}

std::vector<std::uint16_t> SimCamera::picture(Time start, Time end, int lit, std::uint64_t noise) {
  // How much of the three bands' radiance a pixel of each colour takes up; a mono sensor is one
  // colour that takes everything.
  const bool bayer = options_.pixel_format != PixelFormat::mono;
  std::array<std::array<double, 3>, 3> uptake{};
  std::array<double, 3> everywhere{};  // light that reaches every pixel
  everywhere.fill(ambient_at(start + (end - start) / 2));
  Bands bands{};
  std::shared_ptr<const RadianceImage> scene;
  if (lit != SimLightSource::kDark) {
    const auto channel = static_cast<std::size_t>(lit);
    const double output = view_.lamp_output.at(channel, start + (end - start) / 2);
    for (std::size_t colour = 0; colour < 3; ++colour) {
      for (std::size_t band = 0; band < 3; ++band) {
        const double share = bayer ? options_.bayer_crosstalk[colour][band] : 1.0;
        uptake[colour][band] =
            share * output * lamp_.channels[channel].intensity_w_per_sr[static_cast<int>(band)];
        everywhere[colour] +=
            lamp_.stray_fraction * renderer_.white_radiance() * uptake[colour][band];
        bands[band] = bands[band] || uptake[colour][band] != 0.0;
      }
    }
    scene = scene_during(start, end, bands);
  }

  const auto width = static_cast<std::size_t>(options_.width_px);
  const auto rates = [&](std::size_t first, std::span<double> electrons_per_s) {
    const std::size_t count = electrons_per_s.size();
    for (std::size_t i = 0; i < count; ++i) {
      electrons_per_s[i] =
          everywhere[bayer ? static_cast<std::size_t>(bayer_colour(
                                 options_.pixel_format, (first + i) / width, (first + i) % width))
                           : 0];
    }
    for (std::size_t band = 0; band < 3; ++band) {
      if (!bands[band]) continue;
      const float* const radiance = scene->planes[band].data() + first;
      if (bayer) {
        for (std::size_t i = 0; i < count; ++i) {
          const auto colour = static_cast<std::size_t>(
              bayer_colour(options_.pixel_format, (first + i) / width, (first + i) % width));
          electrons_per_s[i] += uptake[colour][band] * radiance[i];
        }
      } else {
        for (std::size_t i = 0; i < count; ++i) {
          electrons_per_s[i] += uptake[0][band] * radiance[i];
        }
      }
    }
    for (std::size_t i = 0; i < count; ++i) {
      electrons_per_s[i] *= options_.responsivity_e_per_s * renderer_.lens().vignetting(first + i);
    }
  };
  return sensor_.expose(rates, devices::to_seconds(end - start), noise);
}

std::shared_ptr<const RadianceImage> SimCamera::scene_during(Time start, Time end,
                                                             const Bands& bands) {
  const devices::Target target = view_.changer.mounted();
  if (at_rest_during(start, end)) return renderer_.render(joints_at(start), target, bands);

  const rig::Joints first = joints_at(start);
  const rig::Joints last = joints_at(end);
  double travel_deg = 0.0;
  for (std::size_t axis = 0; axis < first.size(); ++axis) {
    travel_deg = std::max(travel_deg, std::abs((last[axis] - first[axis]).degrees()));
  }
  const int steps =
      std::clamp(static_cast<int>(std::ceil(travel_deg / kBlurStepDeg)), 2, kMaxBlurSteps);
  auto mean = std::make_shared<RadianceImage>();
  for (int step = 0; step < steps; ++step) {
    const Time middle = start + (end - start) * (2 * step + 1) / (2 * steps);
    const auto image = renderer_.render(joints_at(middle), target, bands);
    for (std::size_t band = 0; band < 3; ++band) {
      if (!bands[band]) continue;
      mean->planes[band].resize(image->planes[band].size(), 0.0F);
      for (std::size_t pixel = 0; pixel < image->planes[band].size(); ++pixel) {
        mean->planes[band][pixel] += image->planes[band][pixel] / static_cast<float>(steps);
      }
    }
  }
  return mean;
}

rig::Joints SimCamera::joints_at(Time time) const {
  rig::Joints joints;
  for (const auto& joint : view_.joints) joints.push_back(joint->true_angle(time));
  return joints;
}

}  // namespace gonio::sim
