#include "limit_checks.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "gonio/rig/paths.h"
#include "tolerance.h"

namespace gonio::rig {
namespace {

double degrees_of_cosine(double cosine) {
  return Angle::from_radians(std::acos(std::clamp(cosine, -1.0, 1.0))).degrees();
}

/// Polar cosines of the light and of the detector as this rig would see them.
brdf::PolarCosines cosines_of(const brdf::HalfDiff& direction, bool exchanged) {
  const auto c = brdf::polar_cosines(direction.theta_h, direction.theta_d, direction.phi_d);
  return exchanged ? brdf::PolarCosines{c.cos_theta_o, c.cos_theta_i} : c;
}

/// Largest angle from the optical axis, as a tangent, under which a disc of radius `radius_mm`
/// around the looked-at point is seen, tilted by theta_o. A rim point at c = cos t along the tilt
/// has tan^2 = (1 - x^2)/(d/r - x)^2 with x = c sin theta_o; its maximum over x is at r/d.
double tangent_of_disc(double radius_mm, double distance_mm, double cos_theta_o) {
  if (radius_mm >= distance_mm) return HUGE_VAL;
  const double ratio = distance_mm / radius_mm;
  const double sin_theta_o = std::sqrt(std::max(0.0, 1.0 - cos_theta_o * cos_theta_o));
  const double x = std::min(1.0 / ratio, sin_theta_o);
  return std::sqrt(1.0 - x * x) / (ratio - x);
}

bool within_limits(const Axis& axis, Angle joint) {
  return joint >= axis.min - kAngleTolerance && joint <= axis.max + kAngleTolerance;
}

}  // namespace

DirectionChecks::DirectionChecks(const MeasurementLimits& limits, double camera_distance_mm)
    : limits_(limits),
      cos_theta_i_max_(cos(limits.theta_i_max + kAngleTolerance)),
      cos_theta_o_max_(cos(limits.theta_o_max + kAngleTolerance)),
      camera_distance_mm_(camera_distance_mm) {}

std::optional<Reason> DirectionChecks::refusal_reason(const brdf::HalfDiff& direction,
                                                      bool exchanged) const {
  if (!brdf::above_horizon(direction.theta_h, direction.theta_d, direction.phi_d)) {
    return Reason::BelowHorizon;
  }
  const brdf::PolarCosines cosines = cosines_of(direction, exchanged);
  if (cosines.cos_theta_i < cos_theta_i_max_) return Reason::GrazingIn;
  if (cosines.cos_theta_o < cos_theta_o_max_) return Reason::GrazingOut;
  if (direction.theta_d < limits_.theta_d_min - kAngleTolerance) return Reason::OccludedLamp;
  if (!footprint_fits(cosines.cos_theta_o)) return Reason::Footprint;
  return std::nullopt;
}

bool DirectionChecks::footprint_fits(double cos_theta_o) const {
  const FootprintLimits& f = limits_.footprint;
  if (f.sample_half_width_mm <= 0.0) return true;
  const double usable_mm = f.sample_half_width_mm - f.edge_margin_mm;
  const double rounding_mm = 1e-9 * usable_mm;  // as kAngleTolerance: limits are inclusive
  if (f.spot_half_width_mm > usable_mm * cos_theta_o + rounding_mm) return false;
  if (usable_mm * cos_theta_o + rounding_mm < f.min_projected_half_width_mm) return false;
  return f.camera_half_field == Angle() ||
         tangent_of_disc(usable_mm, camera_distance_mm_, cos_theta_o) <=
             tan(f.camera_half_field + kAngleTolerance);
}

std::string DirectionChecks::detail(Reason reason, const brdf::HalfDiff& direction,
                                    bool exchanged) const {
  const brdf::PolarCosines cosines = cosines_of(direction, exchanged);
  const double theta_i = degrees_of_cosine(cosines.cos_theta_i);
  const double theta_o = degrees_of_cosine(cosines.cos_theta_o);
  const FootprintLimits& f = limits_.footprint;
  switch (reason) {
    case Reason::BelowHorizon:
      return theta_i >= theta_o ? fmt::format("theta_i {:.2f} deg, expected below 90", theta_i)
                                : fmt::format("theta_o {:.2f} deg, expected below 90", theta_o);
    case Reason::GrazingIn:
      return fmt::format("theta_i {:.2f} deg, at most {:.2f}", theta_i,
                         limits_.theta_i_max.degrees());
    case Reason::GrazingOut:
      return fmt::format("theta_o {:.2f} deg, at most {:.2f}", theta_o,
                         limits_.theta_o_max.degrees());
    case Reason::OccludedLamp:
      return fmt::format(
          "theta_d {:.2f} deg, at least {:.2f}: the lamp would stand in front of "
          "the camera",
          direction.theta_d.degrees(), limits_.theta_d_min.degrees());
    case Reason::Footprint:
      return fmt::format(
          "theta_o {:.2f} deg leaves {:.2f} mm of the usable half width {:.2f} mm in sight, for a "
          "spot of {:.2f} mm, at least {:.2f} mm, within {:.2f} deg of the camera's axis",
          theta_o, (f.sample_half_width_mm - f.edge_margin_mm) * cosines.cos_theta_o,
          f.sample_half_width_mm - f.edge_margin_mm, f.spot_half_width_mm,
          f.min_projected_half_width_mm, f.camera_half_field.degrees());
    default:
      return {};
  }
}

std::optional<Reason> joints_refusal_reason(const RigDescription& rig, const Joints& joints) {
  for (std::size_t k = 0; k < joints.size(); ++k) {
    if (!within_limits(rig.axes[k], joints[k])) return Reason::AxisLimit;
  }
  if (!rig.keep_outs.empty() && keep_out_at(rig, joints, kPlanningMargin)) return Reason::KeepOut;
  return std::nullopt;
}

std::string joints_refusal_detail(const RigDescription& rig, const Joints& joints) {
  for (std::size_t k = 0; k < joints.size(); ++k) {
    const Axis& axis = rig.axes[k];
    if (within_limits(axis, joints[k])) continue;
    return fmt::format("{} {:.2f} deg, allowed {:.2f} to {:.2f}", axis.name, joints[k].degrees(),
                       axis.min.degrees(), axis.max.degrees());
  }
  return keep_out_at(rig, joints, kPlanningMargin).value_or("");
}

}  // namespace gonio::rig
