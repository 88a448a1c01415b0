#include "recovery.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <cmath>

#include "gauge.h"

namespace gonio::calibration::routine::test {
namespace {

double degrees_between(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return Angle::from_radians(std::atan2(a.cross(b).norm(), a.dot(b))).degrees();
}

instrument::CameraModel true_camera(const sim::CameraOptions& c) {
  return {c.width_px, c.height_px, c.fx_px, c.fy_px, c.cx_px, c.cy_px, c.k1, c.k2, c.p1, c.p2};
}

rig::Joints deg(double arm, double azimuth, double tilt) {
  return {Angle::from_degrees(arm), Angle::from_degrees(azimuth), Angle::from_degrees(tilt)};
}

/// A zero's, of one homing, which is compared with the truth: the mean of all.
double with_homing(double variance, const Findings& found, const std::string& axis) {
  const double homing = homing_scatter(found, axis).radians();
  return variance + homing * homing;
}

}  // namespace

rig::Joints true_joints(const sim::SimOptions& truth, const rig::Joints& readings) {
  rig::Joints joints = readings;
  for (std::size_t i = 0; i < joints.size(); ++i) {
    joints[i] += truth.axes[i].zero_offset - 0.5 * truth.axes[i].backlash;
  }
  return joints;
}

std::vector<Recovered> recovered(const Routine& routine, const sim::SimOptions& truth,
                                 double angles) {
  const Findings& found = routine.findings();
  const instrument::Instrument instrument = routine.instrument();
  std::vector<Recovered> all;

  const auto& transfer = found.photon_transfer.value();
  const double gain = truth.camera.dn_per_electron;
  all.push_back({"gain", "", transfer.gain_dn_per_e.value / gain - 1.0,
                 transfer.gain_dn_per_e.sigma / gain, 1, 0.01});
  const double noise = truth.camera.read_noise_e;
  all.push_back({"read noise", "", transfer.read_noise_e.value / noise - 1.0,
                 transfer.read_noise_e.sigma / noise, 1, 0.03});

  const geometry::StageAxes& stage = found.stage.value();
  const double f = truth.camera.fx_px;
  all.push_back({"focal length", "", stage.camera.fx_px / f - 1.0,
                 std::sqrt(stage.covariance(geometry::stage_parameter::kCamera,
                                            geometry::stage_parameter::kCamera)) /
                     f,
                 1, 0.001});

  const Eigen::Isometry3d to_gauge = calibration::test::gauge_from_world(truth.rig);
  const instrument::CameraModel lens = true_camera(truth.camera);
  const Eigen::Matrix3d camera_axes = to_gauge.linear() * truth.rig.camera.home_pose.linear();
  for (const double column : {0.3, 0.7}) {
    for (const double row : {0.3, 0.7}) {
      const Eigen::Vector2d pixel(column * truth.camera.width_px, row * truth.camera.height_px);
      const auto ray = geometry::pixel_ray(stage, pixel);
      all.push_back({fmt::format("pixel ray {:.1f} {:.1f}", column, row), "deg",
                     degrees_between(ray.direction, camera_axes * lens.ray(pixel.x(), pixel.y())),
                     ray.sigma().degrees(), 2, 0.01 * angles});
    }
  }
  const AngleEstimate between = geometry::axis_angle(stage);
  all.push_back({"angle between axes", "deg",
                 between.value.degrees() - degrees_between(truth.rig.sample.links[0].direction,
                                                           truth.rig.sample.links[1].direction),
                 between.sigma.degrees(), 1, 0.01 * angles});

  const Eigen::Matrix2d& zeros = found.zeros.value().covariance;
  const double azimuth_variance = with_homing(zeros(0, 0), found, "azimuth");
  const double tilt_variance = with_homing(zeros(1, 1), found, "tilt");
  const auto normal_at = [](const rig::RigDescription& rig, const rig::Joints& readings) {
    return Eigen::Vector3d(rig::forward(rig, readings).world_from_sample.linear().col(2));
  };
  // Of this homing: u_normal of the constants is of a session's. Axes that lean differently show
  // more at some poses than at others.
  const auto normal_sigma = [&](const rig::Joints& readings) {
    const Eigen::Vector3d middle = normal_at(found.zeros->rig, readings);
    double variance = 0.5 * (azimuth_variance - zeros(0, 0) + tilt_variance - zeros(1, 1));
    for (const CalibratedRig& other : found.zeros->one_sigma_rigs) {
      variance += 0.5 * (normal_at(other.rig, readings) - middle).squaredNorm();
    }
    return Angle::from_radians(std::sqrt(variance));
  };
  for (const auto& readings : {deg(60, 0, 0), deg(60, 30, 10), deg(60, -30, 30)}) {
    const Eigen::Vector3d normal = normal_at(instrument.rig, readings);
    const Eigen::Vector3d really =
        to_gauge.linear() * normal_at(truth.rig, true_joints(truth, readings));
    all.push_back({fmt::format("sample normal at azimuth {:g}, tilt {:g}", readings[1].degrees(),
                               readings[2].degrees()),
                   "deg", degrees_between(normal, really), normal_sigma(readings).degrees(), 2,
                   0.01 * angles});
    if (readings[1].radians() != 0.0) continue;
    const auto heading = [](const Eigen::Vector3d& n) { return std::atan2(n.y(), n.x()); };
    all.push_back({"azimuth zero", "deg",
                   Angle::from_radians(heading(normal) - heading(really)).degrees(),
                   Angle::from_radians(std::sqrt(azimuth_variance)).degrees(), 1, 0.01 * angles});
    all.push_back({"tilt zero", "deg",
                   Angle::from_radians(std::asin(normal.z()) - std::asin(really.z())).degrees(),
                   Angle::from_radians(std::sqrt(tilt_variance)).degrees(), 1, 0.01 * angles});
  }
  geometry::LampArm lamp = found.lamp_arm.value();
  double& arm_variance =
      lamp.covariance(geometry::lamp_parameter::kOffset, geometry::lamp_parameter::kOffset);
  arm_variance = with_homing(arm_variance, found, "lamp_arm");
  for (const double arm_deg : {15.0, 50.0, 85.0, 120.0, 155.0}) {
    const auto readings = deg(arm_deg, 0, 0);
    const Eigen::Vector3d really =
        to_gauge *
        rig::forward(truth.rig, true_joints(truth, readings)).world_from_lamp.translation();
    const auto wi = geometry::lamp_direction(lamp, readings[0]);
    all.push_back({fmt::format("wi at {:g} deg", arm_deg), "deg",
                   degrees_between(wi.direction, really), wi.sigma().degrees(), 2, 0.02 * angles});
  }
  const auto at_home = deg(60, 0, 0);
  const double distance_mm =
      (to_gauge *
       rig::forward(truth.rig, true_joints(truth, at_home)).world_from_lamp.translation())
          .norm();
  const auto distance = geometry::lamp_distance(lamp, at_home[0]);
  all.push_back({"lamp distance", "", distance.value_mm / distance_mm - 1.0,
                 distance.sigma_mm / distance_mm, 1, 0.003});
  for (std::size_t i = 0; i < truth.rig.axes.size(); ++i) {
    const auto& axis = found.repeatability.at(truth.rig.axes[i].name);
    all.push_back({truth.rig.axes[i].name + " backlash", "deg",
                   (axis.backlash.value - truth.axes[i].backlash).degrees(),
                   axis.backlash.sigma.degrees(), 1, 0.005});
  }
  constexpr double kSquareMm = 1e6;  // per square metre
  for (std::size_t channel = 0; channel < truth.lamp.channels.size(); ++channel) {
    const double really = truth.camera.dn_per_electron * truth.camera.responsivity_e_per_s *
                          truth.lamp.channels[channel].intensity_w_per_sr.sum() * kSquareMm;
    const WhiteConstant& white = found.white.value();
    all.push_back({"white constant " + truth.lamp.channels[channel].name, "",
                   white.constant[channel] / really - 1.0, white.relative_sigma[channel], 1,
                   0.003});
  }
  return all;
}

}  // namespace gonio::calibration::routine::test
