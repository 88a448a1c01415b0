#include "exposure_prediction.h"

#include <algorithm>
#include <cmath>

#include "bracket_rules.h"
#include "gonio/devices/clock.h"
#include "saturation.h"

namespace gonio::acquisition {
namespace {

/// Of the time the wanted sigma needs: a second exposure costs more than a little light too much.
constexpr double kAmple = 1.2;

double brightest(const std::vector<ExpectedRegion>& regions) {
  double found = 0.0;
  for (const ExpectedRegion& region : regions) found = std::max(found, region.mean_dn_per_s);
  return found;
}

}  // namespace

double ExpectedSample::margin() const { return std::exp(std::hypot(sigma_ln, point_sigma_ln)); }

std::chrono::nanoseconds predicted_exposure(const std::vector<ExpectedRegion>& regions,
                                            const instrument::SensorModel& sensor,
                                            const SessionOptions& options,
                                            const devices::CameraInfo& camera, double brightness) {
  double highest_dn_per_s = 0.0;
  double needed_s = 0.0;
  for (const ExpectedRegion& region : regions) {
    highest_dn_per_s = std::max(highest_dn_per_s, region.maximum_dn_per_s * brightness);
    needed_s = std::max(needed_s, wanted_signal_dn(sensor, options, region.pixels) /
                                      std::max(region.mean_dn_per_s, 1e-9));
  }
  const double full_dn =
      saturation_level_dn(sensor, camera.saturation_level_dn) - sensor.black_level_dn;
  const double aimed_s = kAimedFraction * full_dn / std::max(highest_dn_per_s, 1e-9);
  const double start_s =
      std::min(aimed_s, std::max(devices::to_seconds(camera.readout), kAmple * needed_s)) -
      sensor.shutter_offset_s;
  const auto longest = std::min(options.max_exposure, camera.max_exposure);
  const double clamped_s =
      std::clamp(start_s, devices::to_seconds(camera.min_exposure), devices::to_seconds(longest));
  return std::clamp(std::chrono::nanoseconds(std::llround(1e9 * clamped_s)), camera.min_exposure,
                    longest);
}

ExposurePrediction::ExposurePrediction(const instrument::Instrument& instrument,
                                       const SessionOptions& options,
                                       const devices::CameraInfo& camera,
                                       const Expectation& expectation)
    : instrument_(instrument), options_(options), camera_(camera), expectation_(expectation) {}

void ExposurePrediction::see_white(const std::string& channel, const rig::Joints& joints,
                                   double brightest_dn_per_s) {
  const auto expected = expected_regions(instrument_, rig::forward(instrument_.rig, joints),
                                         white_square(options_), camera_.pixel_format,
                                         expectation_.light, [&](const brdf::DirectionPair& pair) {
                                           return instrument::white_brdf(instrument_.white, pair);
                                         });
  for (std::size_t i = 0; i < expectation_.light.channels.size(); ++i) {
    if (expectation_.light.channels[i].name != channel) continue;
    const double by_rig_file = brightest(expected[i]);
    if (by_rig_file > 0.0 && brightest_dn_per_s > 0.0) {
      light_[channel] = brightest_dn_per_s / by_rig_file;
    }
  }
}

std::map<std::string, std::chrono::nanoseconds> ExposurePrediction::at(
    std::size_t point, const rig::Joints& joints,
    const std::optional<ExpectedSample>& sample_now) const {
  const ExpectedSample& sample = sample_now ? *sample_now : expectation_.sample;
  ExpectedLight light = expectation_.light;
  for (ExpectedLight::Channel& channel : light.channels) {
    const auto seen = light_.find(channel.name);
    if (seen != light_.end()) channel.constant *= seen->second;
  }
  const TargetSquare square{Eigen::Vector2d::Zero(), options_.sample_half_width_mm, 3};
  const auto regions = expected_regions(
      instrument_, rig::forward(instrument_.rig, joints), square, camera_.pixel_format, light,
      [&](const brdf::DirectionPair& pair) { return sample.brdf(point, pair); });
  std::map<std::string, std::chrono::nanoseconds> found;
  for (std::size_t i = 0; i < light.channels.size(); ++i) {
    const std::string& channel = light.channels[i].name;
    if (regions[i].empty() || !light_.contains(channel)) continue;
    found[channel] =
        predicted_exposure(regions[i], instrument_.sensor, options_, camera_, sample.margin());
  }
  return found;
}

}  // namespace gonio::acquisition
