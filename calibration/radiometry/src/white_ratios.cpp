#include "gonio/calibration/radiometry/white_ratios.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "gonio/instrument/measurement_equation.h"

namespace gonio::calibration {
namespace {

constexpr double kRepeatLimit = 0.003;
constexpr double kReciprocityLimit = 0.01;
constexpr double kEnergyLimit = 0.02;
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
  double known = 0.0;   ///< as certificate and instrument say, 1/sr
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
    middle.known += instrument::white_brdf(instrument.white, seen->directions)[view.channel];
    wi += seen->directions.wi;
    wo += seen->directions.wo;
    count += 1.0;
  }
  if (count == 0.0 || !(constant > 0.0)) return std::nullopt;
  middle.signal /= count;
  middle.brdf /= count;
  middle.known /= count;
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

/// Share of light from theta_i that a white of this certificate throws back, by the midpoint rule.
double directional_albedo(const instrument::WhiteReference& white, Angle theta_i, int channel) {
  constexpr int kRings = 30;  // of equal projected solid angle
  constexpr int kSectors = 36;
  const Eigen::Vector3d wi(sin(theta_i), 0.0, cos(theta_i));
  double sum = 0.0;
  for (int ring = 0; ring < kRings; ++ring) {
    const double sine = std::sqrt((ring + 0.5) / kRings);
    const double cosine = std::sqrt(1.0 - sine * sine);
    for (int sector = 0; sector < kSectors; ++sector) {
      const double phi = 2.0 * std::numbers::pi * (sector + 0.5) / kSectors;
      sum += instrument::white_brdf(
          white, {wi, {sine * std::cos(phi), sine * std::sin(phi), cosine}})[channel];
    }
  }
  return std::numbers::pi * sum / (kRings * kSectors);
}

/// Keeps the one that is farthest from what is expected.
void keep_worst(std::optional<RatioCheck>& worst, const char* name, double found, double limit) {
  if (worst && std::abs(worst->found - 1.0) >= std::abs(found - 1.0)) return;
  worst = RatioCheck{name, found, 1.0, limit};
}

}  // namespace

std::vector<RatioCheck> white_ratios(const instrument::Instrument& instrument,
                                     const VerificationData& data) {
  std::vector<Middle> middles;
  for (const WhiteView& view : data.white) {
    if (const auto middle = middle_of(instrument, data, view)) middles.push_back(*middle);
  }
  std::optional<RatioCheck> repeat;
  std::optional<RatioCheck> reciprocity;
  std::optional<RatioCheck> energy;
  for (auto later = middles.begin(); later != middles.end(); ++later) {
    for (auto earlier = middles.begin(); earlier != later; ++earlier) {
      if (earlier->channel != later->channel) continue;
      if (same_pose(*earlier, *later)) {
        keep_worst(repeat, "white of the first pose, repeated, relative",
                   later->signal / earlier->signal, kRepeatLimit);
      } else if (exchanged(*earlier, *later)) {
        keep_worst(reciprocity, "light and camera exchanged (reciprocity), relative",
                   later->brdf / earlier->brdf, kReciprocityLimit);
      }
    }
    const double albedo =
        later->brdf / later->known *
        directional_albedo(instrument.white, from_normal(later->directions.wi), later->channel);
    keep_worst(energy, "white throws back more than it gets (energy), relative",
               std::max(1.0, albedo), kEnergyLimit);
  }
  std::vector<RatioCheck> ratios;
  for (const auto& check : {repeat, reciprocity, energy}) {
    if (check) ratios.push_back(*check);
  }
  return ratios;
}

}  // namespace gonio::calibration
