#include "gonio/calibration/radiometry/white_ratios.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <vector>

#include "gonio/calibration/radiometry/hemispherical_reflectance.h"
#include "gonio/instrument/measurement_equation.h"

namespace gonio::calibration {
namespace {

constexpr double kRepeatLimit = 0.003;
constexpr double kReciprocityLimit = 0.01;
constexpr double kHemisphereLimit = 0.0075;
constexpr double kEnergySigmas = 2.0;
// What is compared: the middle of the target, where a pose's angles are those of its axes.
constexpr double kMiddle_mm = 8.0;
const Angle kSamePose = Angle::from_degrees(0.05);
const Angle kSameAngle = Angle::from_degrees(0.5);
const Angle kExchanged = Angle::from_degrees(5.0);  // theta_i and theta_o apart: worth exchanging

/// The middle of the white in one view.
struct Middle {
  int channel = 0;
  const rig::Joints* joints = nullptr;
  double signal = 0.0;  ///< DN/s per unit of the monitor, mean
  double brdf = 0.0;    ///< as the instrument reduces it, 1/sr
  brdf::DirectionPair directions;
};

std::optional<Middle> middle_of(const instrument::Instrument& instrument,
                                const VerificationData& data, const WhiteView& view) {
  const rig::RigPose pose = rig::forward(instrument.rig, view.joints);
  const double constant = data.constant[static_cast<std::size_t>(view.channel)];
  Middle middle;
  middle.channel = view.channel;
  middle.joints = &view.joints;
  Eigen::Vector3d wi = Eigen::Vector3d::Zero();
  Eigen::Vector3d wo = Eigen::Vector3d::Zero();
  double count = 0.0;
  for (const PixelSignal& pixel : view.pixels) {
    const auto seen = instrument::pixel_geometry(instrument, pose, pixel.column, pixel.row);
    if (!seen || seen->point_in_sample_mm.head<2>().cwiseAbs().maxCoeff() > kMiddle_mm) continue;
    const double signal = pixel.dn_per_s / view.monitor;
    middle.signal += signal;
    middle.brdf +=
        (signal / constant - instrument.stray.fraction * seen->stray_factor) / seen->factor;
    wi += seen->directions.wi;
    wo += seen->directions.wo;
    count += 1.0;
  }
  if (count == 0.0 || !(constant > 0.0)) return std::nullopt;
  middle.signal /= count;
  middle.brdf /= count;
  middle.directions = {wi.normalized(), wo.normalized()};
  return middle;
}

bool same_pose(const Middle& a, const Middle& b) {
  return std::equal(a.joints->begin(), a.joints->end(), b.joints->begin(),
                    [](Angle one, Angle other) { return abs(one - other) < kSamePose; });
}

Angle from_normal(const Eigen::Vector3d& direction) {
  return Angle::from_radians(std::acos(std::clamp(direction.z(), -1.0, 1.0)));
}

/// For a white, which looks the same from all sides: the angles from the normal have changed places
/// and that between the beams is the same.
bool exchanged(const Middle& a, const Middle& b) {
  const Angle in = from_normal(a.directions.wi);
  const Angle out = from_normal(a.directions.wo);
  const auto between = [](const Middle& m) {
    return Angle::from_radians(
        std::acos(std::clamp(m.directions.wi.dot(m.directions.wo), -1., 1.)));
  };
  return abs(in - out) > kExchanged && abs(in - from_normal(b.directions.wo)) < kSameAngle &&
         abs(out - from_normal(b.directions.wi)) < kSameAngle &&
         abs(between(a) - between(b)) < kSameAngle;
}

/// Keeps the one that is farthest from what is expected.
void keep_worst(std::optional<RatioCheck>& worst, const char* name, double found, double limit) {
  if (worst && std::abs(worst->found - 1.0) >= std::abs(found - 1.0)) return;
  worst = RatioCheck{name, found, 1.0, limit};
}

}  // namespace

WhiteRatios white_ratios(const instrument::Instrument& instrument, const VerificationData& data) {
  std::vector<Middle> middles;
  std::array<std::vector<WhiteReading>, 3> readings;
  for (const WhiteView& view : data.white) {
    const auto middle = middle_of(instrument, data, view);
    if (!middle) continue;
    middles.push_back(*middle);
    if (middle->directions.wi.z() > 0.0 && middle->directions.wo.z() > 0.0) {
      readings[static_cast<std::size_t>(view.channel)].push_back(
          {middle->directions, middle->brdf});
    }
  }
  WhiteRatios ratios;
  for (auto later = middles.begin(); later != middles.end(); ++later) {
    for (auto earlier = middles.begin(); earlier != later; ++earlier) {
      if (earlier->channel != later->channel) continue;
      if (same_pose(*earlier, *later)) {
        keep_worst(ratios.repeat, "white of the first pose, repeated, relative",
                   later->signal / earlier->signal, kRepeatLimit);
      } else if (exchanged(*earlier, *later)) {
        keep_worst(ratios.reciprocity, "light and camera exchanged (reciprocity), relative",
                   later->brdf / earlier->brdf, kReciprocityLimit);
      }
    }
  }
  for (int channel = 0; channel < static_cast<int>(readings.size()); ++channel) {
    const auto& of_colour = readings[static_cast<std::size_t>(channel)];
    if (of_colour.empty()) continue;
    const HemisphericalReflectance all =
        hemispherical_reflectance(instrument.white, channel, of_colour);
    keep_worst(ratios.hemisphere,
               "white's light into all directions over its certificate's, relative",
               all.found / all.certificate, kHemisphereLimit);
    const double sigma = std::hypot(all.sigma, instrument.white.u_relative * all.found);
    keep_worst(ratios.energy, "white throws back more than it gets (energy), relative",
               std::max(1.0, all.found), kEnergySigmas * sigma);
  }
  return ratios;
}

}  // namespace gonio::calibration
