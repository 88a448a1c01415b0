#include "narrower_rig.h"

#include <fmt/format.h>

#include <algorithm>
#include <string>

#include "gonio/console/failures.h"
#include "gonio/rig/paths.h"

namespace gonio::cli {
namespace {

// Degrees that went through a file come back within rounding.
constexpr Angle kSameAngle = Angle::from_radians(1e-9);

std::string axis_list(const rig::RigDescription& rig) {
  std::string text;
  for (const rig::Axis& axis : rig.axes) text += (text.empty() ? "" : ", ") + axis.name;
  return text;
}

/// The smaller of two limits, of which 0 means none.
template <class Limit>
Limit smaller_limit(Limit a, Limit b) {
  if (a == Limit()) return b;
  if (b == Limit()) return a;
  return std::min(a, b);
}

rig::MeasurementLimits narrower(const rig::MeasurementLimits& a, const rig::MeasurementLimits& b) {
  rig::MeasurementLimits limits;
  limits.theta_i_max = std::min(a.theta_i_max, b.theta_i_max);
  limits.theta_o_max = std::min(a.theta_o_max, b.theta_o_max);
  limits.theta_d_min = std::max(a.theta_d_min, b.theta_d_min);
  const rig::FootprintLimits& f = a.footprint;
  const rig::FootprintLimits& g = b.footprint;
  limits.footprint = {
      .sample_half_width_mm = smaller_limit(f.sample_half_width_mm, g.sample_half_width_mm),
      .edge_margin_mm = std::max(f.edge_margin_mm, g.edge_margin_mm),
      .spot_half_width_mm = std::max(f.spot_half_width_mm, g.spot_half_width_mm),
      .min_projected_half_width_mm =
          std::max(f.min_projected_half_width_mm, g.min_projected_half_width_mm),
      .camera_half_field = smaller_limit(f.camera_half_field, g.camera_half_field)};
  return limits;
}

}  // namespace

rig::RigDescription narrower_rig(const rig::RigDescription& calibrated,
                                 const std::filesystem::path& calibration,
                                 const rig::RigDescription& allowed,
                                 const std::filesystem::path& rig_file) {
  if (axis_list(calibrated) != axis_list(allowed)) {
    throw UsageError(fmt::format("{}: rig.axes: found {}, expected {} as in {}",
                                 calibration.string(), axis_list(calibrated), axis_list(allowed),
                                 rig_file.string()));
  }
  rig::RigDescription rig = calibrated;
  for (std::size_t i = 0; i < rig.axes.size(); ++i) {
    rig::Axis& axis = rig.axes[i];
    const rig::Axis& other = allowed.axes[i];
    const std::string places = fmt::format("{}: rig.axes[{}] and {}: axis.{}", calibration.string(),
                                           i, rig_file.string(), axis.name);
    if (axis.home < other.home - kSameAngle || axis.home > other.home + kSameAngle) {
      throw UsageError(fmt::format("{}: home_deg: found {:g} and {:g}, expected the same", places,
                                   axis.home.degrees(), other.home.degrees()));
    }
    axis.min = std::max(axis.min, other.min);  // the home is in both
    axis.max = std::min(axis.max, other.max);
    axis.max_speed_deg_per_s = std::min(axis.max_speed_deg_per_s, other.max_speed_deg_per_s);
    axis.acceleration_deg_per_s2 =
        std::min(axis.acceleration_deg_per_s2, other.acceleration_deg_per_s2);
    axis.settle = std::max(axis.settle, other.settle);
    axis.approach_overshoot = std::max(axis.approach_overshoot, other.approach_overshoot);
  }
  rig.limits = narrower(calibrated.limits, allowed.limits);
  rig.keep_outs.insert(rig.keep_outs.end(), allowed.keep_outs.begin(), allowed.keep_outs.end());
  rig.simultaneous_axes = calibrated.simultaneous_axes && allowed.simultaneous_axes;
  try {
    rig.validate();
  } catch (const std::invalid_argument& error) {
    throw UsageError(fmt::format("{} and {} together: {}", calibration.string(), rig_file.string(),
                                 error.what()));
  }
  if (const auto name = rig::keep_out_at(rig, rig.home(), rig::kPlanningMargin)) {
    throw UsageError(
        fmt::format("{}: rig.keep_outs: \"{}\" holds the axes' home or comes within "
                    "{:g} deg of it",
                    calibration.string(), *name, rig::kPlanningMargin.degrees()));
  }
  return rig;
}

}  // namespace gonio::cli
