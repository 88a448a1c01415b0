#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <stdexcept>

#include "evaluate_steps.h"
#include "gonio/calibration/result/step_refused.h"
#include "gonio/calibration/routine/findings.h"
#include "gonio/errors/errors.h"

namespace gonio::calibration::routine {
namespace {

/// Every move goes past its target by at least this and twice the play, so that an axis is always
/// approached from the same side.
constexpr double kLeastOvershoot_deg = 0.1;

void use_repeatability(const Findings& findings, rig::RigDescription& rig) {
  for (rig::Axis& axis : rig.axes) {
    const auto found = findings.repeatability.find(axis.name);
    if (found == findings.repeatability.end()) continue;
    const double wanted_deg =
        std::max(kLeastOvershoot_deg, 2.0 * found->second.backlash.value.degrees());
    axis.approach_overshoot = std::max(
        axis.approach_overshoot,
        Angle::from_degrees(std::ceil(wanted_deg / kLeastOvershoot_deg) * kLeastOvershoot_deg));
  }
}

void use_sensor(const Findings& findings, instrument::SensorModel& sensor) {
  if (findings.darks) {
    sensor.black_level_dn = findings.darks->black_level_dn.value;
  }
  if (findings.photon_transfer) {
    sensor.gain_dn_per_e = findings.photon_transfer->gain_dn_per_e.value;
    sensor.read_noise_e = findings.photon_transfer->read_noise_e.value;
    if (findings.photon_transfer->full_well_e) {
      sensor.full_well_e = findings.photon_transfer->full_well_e->value;
    }
  }
  if (findings.darks && sensor.gain_dn_per_e > 0.0) {
    sensor.dark_current_e_per_s =
        std::max(0.0, findings.darks->dark_current_dn_per_s.value / sensor.gain_dn_per_e);
  }
  if (findings.non_uniformity) sensor.prnu = findings.non_uniformity->prnu.value;
  if (findings.linearity) {
    sensor.response = findings.linearity->curve;
    sensor.shutter_offset_s = findings.linearity->shutter_offset_s.value;
  }
}

void use_bad_pixels(const Findings& findings, instrument::Instrument& instrument) {
  if (findings.bad_pixels.empty()) return;
  instrument.sensor.bad_pixels.clear();
  const int width = instrument.camera.width_px;
  for (std::size_t i = 0; i < findings.bad_pixels.size(); ++i) {
    if (findings.bad_pixels[i] == 0) continue;
    const int pixel = static_cast<int>(i);
    instrument.sensor.bad_pixels.push_back({pixel % width, pixel / width});
  }
}

/// What the curve leaves of a signal, relative: the sweep's scatter about it and, where it is
/// known worst, the curve's own error. The offset's is not in it: it goes with the exposure.
double residual_of(const sensor::Linearity& linearity) {
  // Of a normal error, standard deviation over mean absolute deviation.
  const double per_mean = std::sqrt(0.5 * std::numbers::pi);
  const double scatter = per_mean * 0.01 * linearity.after_curve_percent;
  const auto& v = linearity.covariance;  // at u = 1: of c1 + c2
  const double curve = v(2, 2) + 2.0 * v(2, 3) + v(3, 3);
  return std::hypot(scatter, std::sqrt(std::max(0.0, curve)));
}

/// Axes, home poses and links as found; limits, speeds and names stay.
void use_geometry(const Findings& findings, rig::RigDescription& rig) {
  const rig::RigDescription* found = nullptr;
  if (findings.stage) found = &findings.stage->rig;
  if (findings.sample_plane) found = &findings.sample_plane->rig;
  if (findings.zeros) found = &findings.zeros->rig;
  if (found != nullptr) {
    rig.camera = found->camera;
    rig.sample = found->sample;
  }
  if (findings.lamp_arm) rig.lamp = findings.lamp_arm->rig.lamp;
}

/// In a session, which homes the axes again: by its own homing and by that of the calibration.
double homing_variance_in_session(const Findings& findings, const std::string& axis) {
  const double scatter = homing_scatter(findings, axis).radians();
  return 2.0 * scatter * scatter;
}

/// How far the normal of the datum may be off in a session, per axis: its zeros, and where the axes
/// stand after another homing and move. How a sample lies on the datum is for its alignment to say.
Angle datum_sigma(const Findings& findings) {
  const Eigen::Matrix2d& zeros = findings.zeros->covariance;
  const double scatter = joint_scatter(findings).radians();
  const double homing = 0.5 * (homing_variance_in_session(findings, "azimuth") +
                               homing_variance_in_session(findings, "tilt"));
  return Angle::from_radians(std::sqrt(0.5 * zeros.trace() + homing + scatter * scatter));
}

/// How far the lamp's direction may be off in a session.
Angle lamp_direction_sigma(const Findings& findings) {
  geometry::LampArm lamp = findings.lamp_arm.value();
  constexpr auto kOffset = geometry::lamp_parameter::kOffset;
  lamp.covariance(kOffset, kOffset) += homing_variance_in_session(findings, "lamp_arm");
  return geometry::worst_direction_sigma(lamp);
}

/// Of what an evaluation cannot do without.
bool has_found(const Findings& findings, std::string_view step) {
  if (step == "intrinsics") return findings.intrinsics.has_value();
  if (step == "stage_axes") return findings.stage.has_value();
  if (step == "sample_plane") return findings.sample_plane.has_value();
  if (step == "lamp_arm") return findings.lamp_arm.has_value();
  if (step == "zero_offsets") return findings.zeros.has_value();
  if (step == "flat_field") return findings.fields.has_value();
  if (step == "white") return findings.white.has_value();
  return true;
}

void require_found(const Findings& findings, const instrument::CalibrationStep& step) {
  for (const std::string_view need : step.needs) {
    if (has_found(findings, need)) continue;
    throw std::invalid_argument(fmt::format(
        "{} cannot be evaluated: found nothing of {}, which it is made from", step.name, need));
  }
}

}  // namespace

instrument::Instrument calibrated(const instrument::Instrument& nominal, const Findings& findings) {
  instrument::Instrument found = nominal;
  use_repeatability(findings, found.rig);
  use_sensor(findings, found.sensor);
  use_bad_pixels(findings, found);
  use_geometry(findings, found.rig);
  if (findings.intrinsics) found.camera = findings.intrinsics->camera;
  if (findings.stage) found.camera = findings.stage->camera;
  if (findings.fields) {
    found.lamp_field = findings.fields->lamp_field;
    found.vignetting = findings.fields->vignetting;
    found.u_lamp_relative = std::hypot(findings.fields->residual_rms, findings.fields->field_sigma);
    if (findings.lamp) {
      found.u_lamp_relative = std::hypot(found.u_lamp_relative, findings.lamp->sigma);
    }
  }
  if (!findings.repeatability.empty()) found.u_joint = joint_scatter(findings);
  if (findings.lamp_arm) {
    found.u_lamp_direction = lamp_direction_sigma(findings);
  }
  if (findings.linearity) {
    found.u_linearity_relative = residual_of(*findings.linearity);
  }
  if (findings.stray) {
    found.stray = {std::max(0.0, findings.stray->fraction),
                   std::hypot(findings.stray->sigma, findings.stray->spread)};
  }
  if (findings.zeros) found.u_normal = datum_sigma(findings);
  return found;
}

instrument::StepResult evaluate(const std::string& step, const Observations& observations,
                                const instrument::Instrument& nominal,
                                const RoutineSettings& settings, Findings& findings) {
  static const std::map<std::string, Evaluate> evaluations{
      {"homing", evaluate_homing},
      {"backlash", evaluate_backlash},
      {"settle_time", evaluate_settling},
      {"warm_up", evaluate_warm_up},
      {"darks", evaluate_darks},
      {"photon_transfer", evaluate_photon_transfer},
      {"linearity", evaluate_linearity},
      {"bad_pixels", evaluate_bad_pixels},
      {"intrinsics", evaluate_intrinsics},
      {"stage_axes", evaluate_stage_axes},
      {"sample_plane", evaluate_sample_plane},
      {"lamp_arm", evaluate_lamp_arm},
      {"zero_offsets", evaluate_zero_offsets},
      {"flat_field", evaluate_flat_field},
      {"stray_light", evaluate_stray_light},
      {"white", evaluate_white},
      {"colour", evaluate_colour},
      {"verification", evaluate_verification}};
  const auto found = evaluations.find(step);
  if (found == evaluations.end()) {
    throw std::invalid_argument("no calibration step is called " + step);
  }
  require_found(findings, *instrument::find_calibration_step(step));
  const instrument::Instrument instrument = calibrated(nominal, findings);
  findings.seen_after[step] = observations.homing;
  ResultBuilder result(step);
  try {
    found->second(observations, {nominal, settings, instrument}, findings, result);
  } catch (const NumericalError& error) {
    throw StepRefused(fmt::format("found nothing that fits what was seen: {}", error.what()));
  }
  return result.take();
}

}  // namespace gonio::calibration::routine
