// The lamp's place over its arc and the zeros of the axes, from its image in the mirror.

#include <Eigen/LU>
#include <array>
#include <cmath>
#include <numbers>

#include "gonio/calibration/result/step_refused.h"
#include "look.h"
#include "mirror.h"

namespace gonio::calibration::routine {
namespace {

constexpr double kFirstArm_deg = 15.0;
constexpr double kLastArm_deg = 150.0;
constexpr double kArmStep_deg = 15.0;
// Either way from the bisecting pose, as the camera sees it; less in azimuth where the mirror
// stands slanted and is narrow.
constexpr double kMirrorTurn_deg = 1.2;
const std::array<Eigen::Vector2d, 5> kTurns{
    {{0.0, 0.0}, {-1.0, -1.0}, {1.0, -1.0}, {-1.0, 1.0}, {1.0, 1.0}}};

const std::array<double, 3> kScanArms_deg{40.0, 80.0, 120.0};
constexpr int kScanSide = 7;
// The aperture in the picture is as wide as the lamp's image, so that what gets through is nearly
// Gaussian in both angles; the scan goes to where a fifth is left.
constexpr double kApertureRadii = 1.0;
constexpr double kScanSigmas = 1.5;

}  // namespace

Observations look_at_lamp_arm(Bench& bench) {
  Observations seen;
  std::size_t done = 0;
  const auto arms = static_cast<std::size_t>((kLastArm_deg - kFirstArm_deg) / kArmStep_deg) + 1;
  for (const bool turned : {false, true}) {
    MirrorSight mirror(bench, turned);
    for (double arm_deg = kFirstArm_deg; arm_deg <= kLastArm_deg; arm_deg += kArmStep_deg) {
      bench.tell("arm angle", done++, 2 * arms);
      const Angle arm = Angle::from_degrees(arm_deg);
      for (const Eigen::Vector2d& turn : kTurns) {
        const rig::Joints pose = mirror.bisecting(
            arm, Angle::from_degrees(kMirrorTurn_deg * std::cos(0.5 * arm.radians()) * turn.x()),
            Angle::from_degrees(kMirrorTurn_deg * turn.y()));
        if (!bench.allowed(pose)) continue;
        const rig::Joints stood = bench.go(pose);
        if (const auto image = mirror.look()) {
          seen.mirrors.push_back({stood, image->pixel, turned});
        }
      }
    }
  }
  return seen;
}

Observations look_at_zero_offsets(Bench& bench) {
  Observations seen;
  std::size_t done = 0;
  for (const bool turned : {false, true}) {
    MirrorSight mirror(bench, turned);
    for (const double arm_deg : kScanArms_deg) {
      const Angle arm = Angle::from_degrees(arm_deg);
      // Which way the image goes and how far: for the middle of the scan and its width.
      const Angle step = Angle::from_degrees(0.2);
      bench.go(mirror.bisecting(arm));
      const Highlight middle = mirror.must_look("the mirror bisecting");
      bench.go(mirror.bisecting(arm, step));
      const Eigen::Vector2d by_azimuth = mirror.must_look("azimuth turned").pixel - middle.pixel;
      bench.go(mirror.bisecting(arm, {}, step));
      const Eigen::Vector2d by_tilt = mirror.must_look("tilt turned").pixel - middle.pixel;
      Eigen::Matrix2d moves;
      moves << by_azimuth, by_tilt;
      const Eigen::Vector2d to_peak =
          moves.inverse() * (bench.middle(mirror.bisecting(arm)) - middle.pixel);
      // A disc of this radius has the second moment of a Gaussian of half of it.
      const double radius = std::max(mirror.expected_radius_px(), middle.radius_px);
      const double aperture = kApertureRadii * radius;
      const double width = std::hypot(aperture, 0.5 * radius);
      const Angle azimuth_step = step * (kScanSigmas * width / by_azimuth.norm() / (kScanSide / 2));
      const Angle tilt_step = step * (kScanSigmas * width / by_tilt.norm() / (kScanSide / 2));
      PeakScan scan;
      scan.turned = turned;
      for (int j = 0; j < kScanSide; ++j) {
        bench.tell("scan line", done++, 2 * kScanArms_deg.size() * kScanSide);
        for (int i = 0; i < kScanSide; ++i) {
          const rig::Joints stood = bench.go(
              mirror.bisecting(arm, to_peak.x() * step + (i - kScanSide / 2) * azimuth_step,
                               to_peak.y() * step + (j - kScanSide / 2) * tilt_step));
          const devices::Frame frame = mirror.frame();
          const double black = bench.instrument().sensor.black_level_dn;
          const double sum =
              windowed_sum(frame, bench.bad_pixels(), black, bench.middle(stood), aperture);
          const double gain = bench.instrument().sensor.gain_dn_per_e;
          const double read = gain * bench.instrument().sensor.read_noise_e;
          // Of the window's weights squared: pi sigma^2 pixels' worth.
          const double sigma = std::sqrt(gain * std::max(sum, 0.0) +
                                         std::numbers::pi * aperture * aperture * read * read);
          scan.samples.push_back({stood, sum, sigma});
        }
      }
      seen.scans.push_back(std::move(scan));
    }
  }
  return seen;
}

}  // namespace gonio::calibration::routine
