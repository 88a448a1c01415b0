// Homing, backlash and settling, seen as the motion of the lamp's image in the mirror: an axis that
// is off by d moves it by up to 2 d times the focal length.

#include <array>
#include <cmath>

#include "look.h"
#include "mirror.h"

namespace gonio::calibration::routine {
namespace {

const Angle kArm = Angle::from_degrees(60.0);
const Angle kScaleStep = Angle::from_degrees(0.4);
const Angle kApproachFrom = Angle::from_degrees(2.0);
const Angle kLongMove = Angle::from_degrees(20.0);
constexpr int kSettlingReadings = 60;
const std::array<const char*, 3> kNames{"lamp_arm", "azimuth", "tilt"};

/// The image at a pose and a little further along one axis, both approached rising.
struct Reference {
  AxisScale scale;
  Angle reading;  ///< of the axis at the pose

  /// Where the axis stands, by its own count, when the image is at a pixel.
  Angle seen(const Eigen::Vector2d& pixel) const { return reading + scale.angle(pixel); }
};

Reference reference_at(Bench& bench, MirrorSight& mirror, const rig::Joints& joints,
                       std::size_t axis) {
  rig::Joints moved = joints;
  moved[axis] = joints[axis] - kApproachFrom;
  bench.go(moved);
  const Angle reading = bench.go(joints)[axis];
  const Eigen::Vector2d here = mirror.must_look("all axes at a target").pixel;
  moved[axis] = joints[axis] + kScaleStep;
  const Angle step = bench.go(moved)[axis] - reading;
  const Eigen::Vector2d there = mirror.must_look("an axis just past its target").pixel;
  return {{here, (there - here) / step.degrees()}, reading};
}

}  // namespace

Observations look_at_homing(Bench& bench) {
  Observations seen;
  MirrorSight mirror(bench, false);
  const rig::Joints pose = mirror.bisecting(kArm);
  const auto all = kNames.size() * static_cast<std::size_t>(bench.settings().homings);
  std::size_t done = 0;
  for (const char* name : kNames) {
    const std::size_t axis = bench.axis(name);
    const Reference reference = reference_at(bench, mirror, pose, axis);
    AxisRecord record{name, {}, {}, {}};
    for (int i = 0; i < bench.settings().homings; ++i) {
      bench.tell("homing", done++, all);
      bench.devices().close_shutter();
      bench.devices().home(axis);
      // Where the move ended beside its target is not the home mark's.
      const Angle reading = bench.go(pose)[axis];
      bench.light(bench.main_channel());
      record.homings.push_back(reference.seen(mirror.must_look("an axis homed").pixel) - reading);
    }
    seen.axes.push_back(std::move(record));
  }
  return seen;
}

Observations look_at_backlash(Bench& bench) {
  Observations seen;
  MirrorSight mirror(bench, false);
  // The image stays in sight while arm and azimuth go along together; tilt has little room.
  const std::vector<double> arms_deg{30.0, 60.0, 90.0, 120.0};
  const std::vector<double> tilts_deg{-0.6, 0.0, 0.6};
  const auto all = 2 * arms_deg.size() + tilts_deg.size();
  std::size_t done = 0;
  for (const char* name : kNames) {
    const std::size_t axis = bench.axis(name);
    AxisRecord record{name, {}, {}, {}};
    const bool tilts = record.axis == "tilt";
    for (const double at_deg : tilts ? tilts_deg : arms_deg) {
      bench.tell("target", done++, all);
      const rig::Joints target = tilts ? mirror.bisecting(kArm, {}, Angle::from_degrees(at_deg))
                                       : mirror.bisecting(Angle::from_degrees(at_deg));
      const Reference reference = reference_at(bench, mirror, target, axis);
      for (int i = 0; i < 2 * bench.settings().approaches; ++i) {
        const bool rising = i % 2 == 0;
        rig::Joints aside = target;
        aside[axis] = target[axis] + (rising ? -1.0 : 1.0) * kApproachFrom;
        bench.go(aside);
        const Angle reading = bench.go(target)[axis];
        const Angle observed = reference.seen(mirror.must_look("an axis at its target").pixel);
        record.approaches.push_back({target[axis], rising, reading, observed});
      }
    }
    seen.axes.push_back(std::move(record));
  }
  return seen;
}

Observations look_at_settling(Bench& bench) {
  Observations seen;
  MirrorSight mirror(bench, false);
  const rig::Joints pose = mirror.bisecting(kArm);
  std::size_t done = 0;
  for (const char* name : kNames) {
    bench.tell("axis", done++, kNames.size());
    const std::size_t axis = bench.axis(name);
    const Reference reference = reference_at(bench, mirror, pose, axis);
    rig::Joints away = pose;
    away[axis] = pose[axis] + kLongMove;
    bench.go(away);
    bench.go(pose);
    const auto arrived = bench.devices().now();
    AxisRecord record{name, {}, {}, {}};
    for (int i = 0; i < kSettlingReadings; ++i) {
      const devices::Frame frame = mirror.frame();
      const auto found =
          find_highlight(frame, bench.bad_pixels(), bench.instrument().sensor.black_level_dn,
                         mirror.expected_radius_px());
      if (!found) continue;
      record.settling.push_back(
          {std::chrono::duration<double>(frame.exposure_start - arrived).count(),
           reference.scale.angle(found->pixel)});
    }
    seen.axes.push_back(std::move(record));
  }
  return seen;
}

}  // namespace gonio::calibration::routine
