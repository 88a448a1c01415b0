#include "preflight.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <stdexcept>
#include <tuple>
#include <vector>

namespace gonio::acquisition {
namespace {

template <class... Parts>
[[noreturn]] void refuse(fmt::format_string<Parts...> text, Parts&&... parts) {
  throw PreflightError("pre-run check: " + fmt::format(text, std::forward<Parts>(parts)...));
}

void check_axes(const DeviceSet& devices, const rig::RigDescription& rig) {
  if (devices.stages.size() != rig.axes.size()) {
    refuse("{} stages for the {} axes of rig {}", devices.stages.size(), rig.axes.size(), rig.name);
  }
  constexpr Angle kTolerance = Angle::from_radians(1e-9);
  for (std::size_t i = 0; i < rig.axes.size(); ++i) {
    const rig::Axis& axis = rig.axes[i];
    const devices::RotationStage* stage = devices.stages[i];
    if (stage == nullptr) refuse("axis {} has no stage", axis.name);
    if (stage->name() != axis.name) {
      refuse("stage {} stands where the rig has axis {}", stage->name(), axis.name);
    }
    const devices::JointLimits limits = stage->limits();
    if (axis.min < limits.min - kTolerance || axis.max > limits.max + kTolerance) {
      refuse("axis {}: the rig allows {:.3f} to {:.3f} deg, the stage only {:.3f} to {:.3f} deg",
             axis.name, axis.min.degrees(), axis.max.degrees(), limits.min.degrees(),
             limits.max.degrees());
    }
  }
}

void check_points(const MeasurementPlan& plan, const rig::RigDescription& rig) {
  if (plan.points.empty()) refuse("no direction to measure");
  if (!plan.refused.empty()) {
    const RefusedDirection& first = plan.refused.front();
    refuse("{} of {} directions cannot be measured, the first ({:g}, {:g}, {:g}) deg: {}: {}",
           plan.refused.size(), plan.refused.size() + plan.points.size(),
           first.direction.angles.theta_h.degrees(), first.direction.angles.theta_d.degrees(),
           first.direction.angles.phi_d.degrees(), rig::to_string(first.refusal.reason),
           first.refusal.detail);
  }
  std::set<std::tuple<double, double, double>> seen;
  for (const PlannedPoint& point : plan.points) {
    const auto& d = point.direction;
    if (!seen.insert({d.theta_h.radians(), d.theta_d.radians(), d.phi_d.radians()}).second) {
      refuse("direction ({:g}, {:g}, {:g}) deg stands twice in the plan", d.theta_h.degrees(),
             d.theta_d.degrees(), d.phi_d.degrees());
    }
    if (point.pose.joints.size() != rig.axes.size()) {
      refuse("a pose of {} joints for {} axes", point.pose.joints.size(), rig.axes.size());
    }
    constexpr Angle kTolerance = Angle::from_radians(1e-9);
    for (std::size_t i = 0; i < rig.axes.size(); ++i) {
      const rig::Axis& axis = rig.axes[i];
      const Angle joint = point.pose.joints[i];
      if (!(joint >= axis.min - kTolerance && joint <= axis.max + kTolerance)) {
        refuse("axis {}: a pose at {:.4f} deg, limits {:.4f} to {:.4f} deg", axis.name,
               joint.degrees(), axis.min.degrees(), axis.max.degrees());
      }
    }
  }
}

void check_camera(const DeviceSet& devices, const instrument::Instrument& instrument,
                  const SessionOptions& options) {
  const devices::CameraInfo info = devices.camera->info();
  if (info.width_px != instrument.camera.width_px ||
      info.height_px != instrument.camera.height_px) {
    refuse("camera {} gives {} x {} px, the calibration is for {} x {} px", devices.camera->name(),
           info.width_px, info.height_px, instrument.camera.width_px, instrument.camera.height_px);
  }
  const double shortest_s =
      std::chrono::duration<double>(info.min_exposure).count() + instrument.sensor.shutter_offset_s;
  if (!(shortest_s > 0.0)) {
    refuse(
        "the calibration's shutter_offset_s, {:g} us, is more than the shortest exposure of "
        "camera {}, {} us: calibrate again",
        1e6 * instrument.sensor.shutter_offset_s, devices.camera->name(),
        info.min_exposure.count() / 1000);
  }
  if (options.first_exposure < info.min_exposure || options.first_exposure > info.max_exposure) {
    refuse("first exposure {} us, camera {} has {} to {} us", options.first_exposure.count() / 1000,
           devices.camera->name(), info.min_exposure.count() / 1000,
           info.max_exposure.count() / 1000);
  }
}

/// Home, white, every point, white, home: each leg must have a way around the keep-outs.
void check_itinerary(const rig::RigDescription& rig, const MeasurementPlan& plan,
                     const rig::Joints& white) {
  const rig::TravelModel travel(rig);
  const rig::Joints home = rig.home();
  std::vector<rig::Joints> stops{home, white};
  for (const PlannedPoint& point : plan.points) stops.push_back(point.pose.joints);
  stops.push_back(white);
  stops.push_back(home);
  for (std::size_t i = 1; i < stops.size(); ++i) {
    if (!travel.route(stops[i - 1], stops[i])) {
      refuse("keep-outs bar the way to stop {} of {} of the session ({})", i, stops.size() - 1,
             i == 1 || i + 2 == stops.size() ? "white"
             : i + 1 == stops.size()         ? "home"
                                             : "point");
    }
  }
}

}  // namespace

void check_before_motion(const DeviceSet& devices, const instrument::Instrument& instrument,
                         const MeasurementPlan& plan, const SessionOptions& options) {
  options.validate();
  try {
    instrument.validate();
  } catch (const std::invalid_argument& error) {
    throw PreflightError(error.what());
  }
  if (devices.camera == nullptr) refuse("no camera");
  if (devices.light == nullptr) refuse("no light source");
  if (devices.clock == nullptr) refuse("no clock");
  check_axes(devices, instrument.rig);
  check_points(plan, instrument.rig);
  check_camera(devices, instrument, options);
  if (devices.light->channels().empty()) refuse("light {} has no channel", devices.light->name());
  if (options.white != WhitePlacement::in_frame && devices.changer == nullptr) {
    refuse("the white is to be changed in, but there is no target changer");
  }
  const rig::Joints white = white_joints(instrument.rig);
  if (white_regions(instrument, options, white).empty()) {
    refuse("the white reference is not in the camera's view");
  }
  check_itinerary(instrument.rig, plan, white);
}

Regions white_regions(const instrument::Instrument& instrument, const SessionOptions& options,
                      const rig::Joints& joints) {
  const rig::RigPose pose = rig::forward(instrument.rig, joints);
  if (options.white == WhitePlacement::in_frame) {
    return regions_of(instrument, pose, options.white_patch_mm, options.white_patch_half_width_mm,
                      1);
  }
  return regions_of(instrument, pose, Eigen::Vector2d::Zero(),
                    options.white_half_width_mm.value_or(options.sample_half_width_mm));
}

rig::Joints white_joints(const rig::RigDescription& rig) {
  const rig::Inverse inverse(rig);
  const rig::TravelModel travel(rig);
  const rig::Joints home = rig.home();
  // theta_i = 45 and theta_o = 0: theta_h = theta_d = 22.5, phi_d = 0. Rigs that cannot (a tilt
  // that does not reach, a lamp that may not come so near, a keep-out in the way) take the next.
  std::vector<brdf::HalfDiff> candidates;
  for (const double theta_d : {22.5, 20.0, 15.0, 10.0, 30.0, 40.0}) {
    for (const double theta_h : {22.5, 15.0, 7.5, 0.0, 30.0}) {
      candidates.push_back(
          {Angle::from_degrees(theta_h), Angle::from_degrees(theta_d), Angle(), Angle()});
    }
  }
  const Angle wanted = Angle::from_degrees(22.5);
  std::stable_sort(candidates.begin(), candidates.end(), [&](const auto& a, const auto& b) {
    const auto distance = [&](const brdf::HalfDiff& d) {
      return std::hypot((d.theta_h - wanted).radians(), (d.theta_d - wanted).radians());
    };
    return distance(a) < distance(b);
  });
  bool reached = false;
  for (const brdf::HalfDiff& direction : candidates) {
    for (const rig::PoseSolution& pose : inverse.solve(direction).poses) {
      reached = true;
      if (travel.route(home, pose.joints) && travel.route(pose.joints, home)) return pose.joints;
    }
  }
  if (reached) refuse("keep-outs bar the way from home to every pose for the white reference");
  refuse("the rig reaches no pose at which a white reference can be measured");
}

}  // namespace gonio::acquisition
