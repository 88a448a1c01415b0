#include <cmath>

#include "evaluate_steps.h"
#include "geometry_uncertainty.h"
#include "gonio/calibration/geometry/intrinsics.h"
#include "gonio/calibration/result/step_refused.h"

namespace gonio::calibration::routine {
namespace {

namespace lamp = geometry::lamp_parameter;
using Named = ResultBuilder::Named;

constexpr double kMaxReprojection_px = 0.3;
// Beyond it the sample swings out of the picture; it is measured, so it need not be small.
constexpr double kMaxSkew_mm = 2.0;
constexpr double kMaxNormal_deg = 0.02;
constexpr double kMaxLampDirection_deg = 0.02;
constexpr double kMaxZero_deg = 0.01;

std::vector<Named> camera_parameters(const instrument::CameraModel& c) {
  return {{"camera.fx_px", "px", c.fx_px}, {"camera.fy_px", "px", c.fy_px},
          {"camera.cx_px", "px", c.cx_px}, {"camera.cy_px", "px", c.cy_px},
          {"camera.k1", "", c.k1},         {"camera.k2", "", c.k2},
          {"camera.p1", "", c.p1},         {"camera.p2", "", c.p2}};
}

/// Rotation vector from the nominal to the found, world axes.
Eigen::Vector3d turn_from(const Eigen::Matrix3d& nominal, const Eigen::Matrix3d& found) {
  const Eigen::AngleAxisd turn(found * nominal.transpose());
  return turn.angle() * turn.axis();
}

const rig::ChainLink& link_of(const rig::RigDescription& rig, const rig::Chain& chain,
                              const std::string& axis) {
  for (const rig::ChainLink& link : chain.links) {
    if (rig.axes.at(link.axis).name == axis) return link;
  }
  throw StepRefused("found no axis " + axis + " under the sample, expected a rig of type la2");
}

}  // namespace

void evaluate_intrinsics(const Observations& seen, const Known& known, Findings& findings,
                         ResultBuilder& result) {
  geometry::IntrinsicsOptions options;
  options.width_px = known.nominal.camera.width_px;
  options.height_px = known.nominal.camera.height_px;
  std::vector<geometry::BoardView> boards;
  for (const geometry::StageView& view : seen.boards) boards.push_back(view.board);
  const geometry::Intrinsics found = geometry::fit_intrinsics(boards, options);
  findings.intrinsics = found;
  result.block(camera_parameters(found.camera), found.covariance);
  result.residual("reprojection_rms_px", found.rms_px);
  result.residual("corner_sigma_px", found.sigma_px);
  result.check("reprojection rms (px)", found.rms_px, kMaxReprojection_px);
  for (std::size_t i = 0; i < found.views.size(); ++i) {
    if (!found.views[i].used) {
      result.note("view " + std::to_string(i) + " left out: " + found.views[i].why_not);
    }
  }
}

void evaluate_stage_axes(const Observations& seen, const Known& known, Findings& findings,
                         ResultBuilder& result) {
  geometry::StageAxesOptions options;
  options.u_joint = joint_scatter(findings);
  const geometry::StageAxes found = geometry::on_its_datum(
      geometry::fit_stage_axes(known.nominal.rig, findings.intrinsics.value(), seen.boards,
                               options),
      geometry::fit_stage_axes(known.nominal.rig, findings.intrinsics.value(), seen.boards_turned,
                               options));
  findings.stage = found;
  const rig::RigDescription& rig = found.rig;
  const Eigen::Isometry3d camera = rig::forward(rig, rig.home()).world_from_camera;
  const Eigen::Vector3d turn = turn_from(
      rig::forward(known.nominal.rig, known.nominal.rig.home()).world_from_camera.linear(),
      camera.linear());
  const rig::ChainLink& tilt = link_of(rig, rig.sample, "tilt");
  const rig::ChainLink& azimuth = link_of(rig, rig.sample, "azimuth");
  const Eigen::Matrix3d board = found.board_from_sample.linear();
  std::vector<Named> parameters{
      {"rig.camera.x_mm", "mm", camera.translation().x()},
      {"rig.camera.z_mm", "mm", camera.translation().z()},
      {"rig.camera.turn_x_deg", "deg", turn.x(), kDegPerRad},
      {"rig.camera.turn_y_deg", "deg", turn.y(), kDegPerRad},
      {"rig.camera.turn_z_deg", "deg", turn.z(), kDegPerRad},
      {"rig.tilt_axis.raised_deg", "deg", std::asin(tilt.direction.z()), kDegPerRad},
      {"rig.tilt_axis.heading_deg", "deg", std::atan2(tilt.direction.y(), tilt.direction.x()),
       kDegPerRad},
      {"rig.tilt_axis.skew_mm", "mm", geometry::axis_skew(found).value_mm},
      {"board.turn_deg", "deg", std::atan2(board(1, 0), board(0, 0)), kDegPerRad},
      {"board.x_mm", "mm", found.board_from_sample.translation().x()},
      {"board.y_mm", "mm", found.board_from_sample.translation().y()},
      {"board.z_mm", "mm", found.board_from_sample.translation().z()},
      {"axis.azimuth.zero_deg", "deg", azimuth.offset.radians(), kDegPerRad},
      {"axis.tilt.zero_deg", "deg", tilt.offset.radians(), kDegPerRad},
      {"axis.azimuth.eccentricity_cos_deg", "deg", found.azimuth_eccentricity.a.radians(),
       kDegPerRad},
      {"axis.azimuth.eccentricity_sin_deg", "deg", found.azimuth_eccentricity.b.radians(),
       kDegPerRad},
      {"axis.tilt.eccentricity_cos_deg", "deg", found.tilt_eccentricity.a.radians(), kDegPerRad},
      {"axis.tilt.eccentricity_sin_deg", "deg", found.tilt_eccentricity.b.radians(), kDegPerRad}};
  for (Named& named : camera_parameters(found.camera)) parameters.push_back(std::move(named));
  result.block(parameters, found.covariance);
  const AngleEstimate between = geometry::axis_angle(found);
  result.residual("reprojection_rms_px", found.rms_px);
  result.residual("axis_angle_deg", between.value.degrees());
  result.residual("axis_angle_sigma_deg", between.sigma.degrees());
  const auto normal = geometry::board_normal(found, rig.home());
  result.residual("board_normal_sigma_deg", normal.sigma().degrees());
  result.check("reprojection rms (px)", found.rms_px, kMaxReprojection_px);
  result.check("distance between the axes (mm)", std::abs(geometry::axis_skew(found).value_mm),
               kMaxSkew_mm);
  result.check("sigma of the board's normal (deg)", normal.sigma().degrees(), kMaxNormal_deg);
  result.notes(found.notes);
}

void evaluate_sample_plane(const Observations&, const Known& known, Findings& findings,
                           ResultBuilder& result) {
  const geometry::SampleDatum& datum = known.settings.sample;
  findings.sample_plane = geometry::sample_plane(findings.stage.value(), datum);
  result.block({{"sample.tilt_x_deg", "deg", 0.0, kDegPerRad},
                {"sample.tilt_y_deg", "deg", 0.0, kDegPerRad},
                {"sample.raised_mm", "mm", datum.raised_mm}},
               findings.sample_plane->covariance);
  result.note("from the datum that the operator gave");
}

void evaluate_lamp_arm(const Observations& seen, const Known& known, Findings& findings,
                       ResultBuilder& result) {
  geometry::LampArmOptions options;
  options.u_joint = joint_scatter(findings);
  geometry::LampArm found = geometry::fit_lamp_arm(stage_after(findings, seen.homing), seen.mirrors,
                                                   known.settings.mirror, options);
  findings.lamp_arm = found;
  // The arm's zero is the mean of all homings, this one is off by its own.
  const double homing = homing_scatter(findings, "lamp_arm").radians();
  found.covariance(lamp::kOffset, lamp::kOffset) += homing * homing;
  const rig::ChainLink& arm = found.rig.lamp.links.at(0);
  const Eigen::Vector3d& lamp_home = found.rig.lamp.home_pose.translation();
  result.block(
      {{"rig.lamp_axis.turn_x_deg", "deg", -arm.direction.y() / arm.direction.z(), kDegPerRad},
       {"rig.lamp_axis.turn_y_deg", "deg", arm.direction.x() / arm.direction.z(), kDegPerRad},
       {"rig.lamp_axis.x_mm", "mm", arm.point_mm.x()},
       {"rig.lamp_axis.y_mm", "mm", arm.point_mm.y()},
       {"rig.lamp.x_mm", "mm", lamp_home.x()},
       {"rig.lamp.z_mm", "mm", lamp_home.z()},
       {"axis.lamp_arm.zero_deg", "deg", arm.offset.radians(), kDegPerRad},
       {"mirror.tilt_x_deg", "deg", found.mirror_tilt_x.radians(), kDegPerRad},
       {"mirror.tilt_y_deg", "deg", found.mirror_tilt_y.radians(), kDegPerRad}},
      found.covariance.topLeftCorner(lamp::kMirrorOffset, lamp::kMirrorOffset));
  result.residual("rms_px", found.rms_px);
  const double worst = geometry::worst_direction_sigma(found).degrees();
  result.residual("direction_sigma_deg", worst);
  result.check("sigma of the lamp's direction (deg)", worst, kMaxLampDirection_deg);
  result.notes(found.notes);
}

void evaluate_zero_offsets(const Observations& seen, const Known& known, Findings& findings,
                           ResultBuilder& result) {
  // The sample's plane with the lamp where it was found.
  rig::RigDescription rig = findings.sample_plane.value().rig;
  rig.lamp = findings.lamp_arm.value().rig.lamp;
  geometry::PeakOptions peak_options;
  peak_options.u_joint = joint_scatter(findings);
  std::vector<geometry::Peak> peaks;
  for (const PeakScan& scan : seen.scans) {
    geometry::Peak peak = geometry::fit_peak(rig, scan.samples, peak_options);
    peak.turned = scan.turned;
    peaks.push_back(peak);
  }
  geometry::PeakFitOptions options;
  options.one_sigma_rigs =
      geometry::one_sigma_rigs(findings.stage.value(), lamp_after(findings, seen.homing));
  for (CalibratedRig& other : options.one_sigma_rigs) {
    Eigen::Isometry3d& face = other.rig.sample.home_pose;
    face.translation() += known.settings.sample.raised_mm * face.linear().col(2);
  }
  const geometry::ZeroOffsets found = geometry::fit_zero_offsets(
      {rig, findings.stage->camera}, peaks, known.settings.mirror.u_tilt, options);
  findings.peaks = peaks;
  findings.zeros = found;
  Eigen::Matrix2d covariance = found.covariance;
  for (const auto& [k, axis] : {std::pair(0, "azimuth"), std::pair(1, "tilt")}) {
    const double homing = homing_scatter(findings, axis).radians();
    covariance(k, k) += homing * homing;
  }
  result.block({{"axis.azimuth.offset_deg", "deg", found.azimuth.radians(), kDegPerRad},
                {"axis.tilt.offset_deg", "deg", found.tilt.radians(), kDegPerRad}},
               covariance);
  result.residual("chi2_per_dof", found.chi2_per_dof);
  for (std::size_t i = 0; i < found.residuals.size(); ++i) {
    result.residual("peak_" + std::to_string(i) + "_deg", kDegPerRad * found.residuals[i].norm());
  }
  result.check("sigma of the azimuth's zero (deg)", kDegPerRad * std::sqrt(covariance(0, 0)),
               kMaxZero_deg);
  result.check("sigma of the tilt's zero (deg)", kDegPerRad * std::sqrt(covariance(1, 1)),
               kMaxZero_deg);
}

}  // namespace gonio::calibration::routine
