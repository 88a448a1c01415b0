#include "mirror.h"

#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "gonio/calibration/result/step_refused.h"

namespace gonio::calibration::routine {
namespace {

constexpr double kLampRadius_mm = 2.5;  // of common fibre and LED heads; only a first guess
constexpr double kMirrorLevel = 0.6;    // of saturation
const Angle kFirstArm = Angle::from_degrees(60.0);
const Angle kSearch = Angle::from_degrees(0.5);
constexpr int kSearchSteps = 3;

}  // namespace

double lamp_image_radius_px(const instrument::Instrument& instrument) {
  const rig::RigPose pose = rig::forward(instrument.rig, instrument.rig.home());
  const double path_mm =
      pose.world_from_camera.translation().norm() + pose.world_from_lamp.translation().norm();
  return std::max(2.0, instrument.camera.fx_px * kLampRadius_mm / path_mm);
}

MirrorSight::MirrorSight(Bench& bench, bool turned) : bench_(bench) {
  bench.devices().mount(turned ? devices::Target::mirror_turned : devices::Target::mirror);
  radius_px_ = lamp_image_radius_px(bench.instrument());
  bench.light(bench.main_channel());

  // The zeros are not known yet: the image lies near the middle, not in it. Two short moves show
  // which way it goes.
  bench.go(bisecting(kFirstArm));
  exposure_ = bench.exposure_for(kMirrorLevel);
  const Eigen::Vector2d wanted = bench.middle(bisecting(kFirstArm));
  for (int step = 0; step < kSearchSteps; ++step) {
    const Highlight here = must_look("the mirror facing between lamp and camera");
    if ((here.pixel - wanted).norm() < 0.5 * radius_px_) break;
    bench.go(bisecting(kFirstArm, kSearch));
    const Eigen::Vector2d by_azimuth = must_look("azimuth a little further").pixel - here.pixel;
    bench.go(bisecting(kFirstArm, {}, kSearch));
    const Eigen::Vector2d by_tilt = must_look("tilt a little further").pixel - here.pixel;
    Eigen::Matrix2d moves;
    moves << by_azimuth, by_tilt;
    if (std::abs(moves.determinant()) < 1.0) {
      throw StepRefused(
          "mirror: found the lamp's image standing still while the axes move, expected it to "
          "follow: is the mirror in the holder, and is the lamp on?");
    }
    const Eigen::Vector2d turns = moves.inverse() * (wanted - here.pixel);
    azimuth_off_ = azimuth_off_ + turns.x() * kSearch;
    tilt_off_ = tilt_off_ + turns.y() * kSearch;
    if (!bench.allowed(bisecting(kFirstArm))) {
      throw StepRefused(fmt::format(
          "mirror: found the lamp's image to want azimuth {:.1f}, tilt {:.1f} deg, beyond the "
          "axes' limits, expected it near the middle: is the mirror in the holder, and do the axes "
          "turn the way the rig file says?",
          (0.5 * kFirstArm + azimuth_off_).degrees(), tilt_off_.degrees()));
    }
    bench.go(bisecting(kFirstArm));
  }
}

rig::Joints MirrorSight::bisecting(Angle lamp_arm, Angle azimuth_off, Angle tilt_off) const {
  return bench_.joints(lamp_arm, 0.5 * lamp_arm + azimuth_off_ + azimuth_off, tilt_off_ + tilt_off);
}

std::optional<Highlight> MirrorSight::look() {
  return find_highlight(frame(), bench_.bad_pixels(), bench_.instrument().sensor.black_level_dn,
                        radius_px_);
}

Highlight MirrorSight::must_look(const std::string& where) {
  const auto found = look();
  if (!found) {
    throw StepRefused(fmt::format(
        "mirror: found no image of the lamp with {}, expected one near the middle of the picture: "
        "is the mirror in the holder, its face outwards, and the lamp on?",
        where));
  }
  return *found;
}

}  // namespace gonio::calibration::routine
