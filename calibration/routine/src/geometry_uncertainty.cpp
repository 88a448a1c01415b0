#include "geometry_uncertainty.h"

#include <cmath>
#include <numbers>

namespace gonio::calibration::routine {
namespace {

/// Of the difference of two homings, rad; 0 for one and the same.
double homed_apart(const Findings& findings, const std::string& step, int homing,
                   const std::string& axis) {
  const auto before = findings.seen_after.find(step);
  if (before != findings.seen_after.end() && before->second == homing) return 0.0;
  return std::numbers::sqrt2 * homing_scatter(findings, axis).radians();
}

}  // namespace

geometry::StageAxes stage_after(const Findings& findings, int homing) {
  namespace at = geometry::stage_parameter;
  geometry::StageAxes stage = findings.stage.value();
  const double azimuth = homed_apart(findings, "stage_axes", homing, "azimuth");
  const double tilt = homed_apart(findings, "stage_axes", homing, "tilt");
  stage.covariance(at::kAzimuthOffset, at::kAzimuthOffset) += azimuth * azimuth;
  stage.covariance(at::kTiltOffset, at::kTiltOffset) += tilt * tilt;
  return stage;
}

geometry::LampArm lamp_after(const Findings& findings, int homing) {
  namespace at = geometry::lamp_parameter;
  geometry::LampArm lamp = findings.lamp_arm.value();
  const double arm = homed_apart(findings, "lamp_arm", homing, "lamp_arm");
  lamp.covariance(at::kOffset, at::kOffset) += arm * arm;
  return lamp;
}

std::vector<CalibratedRig> one_sigma_rigs_after(const Findings& findings, int homing) {
  const geometry::ZeroOffsets& zeros = findings.zeros.value();
  std::vector<CalibratedRig> rigs = zeros.one_sigma_rigs;
  const CalibratedRig found{zeros.rig, findings.stage.value().camera};
  for (rig::Chain rig::RigDescription::*const chain :
       {&rig::RigDescription::lamp, &rig::RigDescription::sample}) {
    for (std::size_t i = 0; i < (found.rig.*chain).links.size(); ++i) {
      const std::string& axis = found.rig.axes.at((found.rig.*chain).links[i].axis).name;
      // The arm's own part counts again what the zeros' rigs have of it where all three steps were
      // homed apart: too wide then, never too sure.
      const double apart = homed_apart(findings, "zero_offsets", homing, axis);
      if (apart == 0.0) continue;
      rigs.push_back(found);
      (rigs.back().rig.*chain).links[i].offset += Angle::from_radians(apart);
    }
  }
  return rigs;
}

}  // namespace gonio::calibration::routine
