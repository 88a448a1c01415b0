#include "gonio/rig/rig_description.h"

#include <cmath>
#include <set>
#include <stdexcept>

#include "tolerance.h"

namespace gonio::rig {
namespace {

constexpr double kUnitTolerance = 1e-6;  // of directions and rotations as people write them

[[noreturn]] void refuse(const std::string& field, const std::string& why) {
  throw std::invalid_argument(field + ": " + why);
}

std::string member(const std::string& list, std::size_t index, const std::string& name) {
  return list + "[" + std::to_string(index) + "]." + name;
}

void require_finite(double value, const std::string& field) {
  if (!std::isfinite(value)) refuse(field, "is not finite");
}

void require_positive(double value, const std::string& field) {
  require_finite(value, field);
  if (value <= 0.0) refuse(field, "found " + std::to_string(value) + ", expected above 0");
}

void require_not_negative(double value, const std::string& field) {
  require_finite(value, field);
  if (value < 0.0) refuse(field, "found " + std::to_string(value) + ", expected at least 0");
}

void require_ordered(Angle min, Angle max, const std::string& field) {
  require_finite(min.radians(), field + "min");
  require_finite(max.radians(), field + "max");
  if (min > max) {
    refuse(field + "min", "found " + std::to_string(min.degrees()) + " deg, above max " +
                              std::to_string(max.degrees()) + " deg");
  }
}

void check_axes(const std::vector<Axis>& axes) {
  if (axes.empty()) refuse("axes", "found none, expected at least one");
  std::set<std::string> names;
  for (std::size_t i = 0; i < axes.size(); ++i) {
    const Axis& axis = axes[i];
    if (axis.name.empty()) refuse(member("axes", i, "name"), "is empty");
    if (!names.insert(axis.name).second) {
      refuse(member("axes", i, "name"), "'" + axis.name + "' is there twice");
    }
    require_ordered(axis.min, axis.max, member("axes", i, ""));
    require_positive(axis.max_speed_deg_per_s, member("axes", i, "max_speed_deg_per_s"));
    require_positive(axis.acceleration_deg_per_s2, member("axes", i, "acceleration_deg_per_s2"));
    if (axis.settle.count() < 0) refuse(member("axes", i, "settle"), "is negative");
    require_not_negative(axis.approach_overshoot.radians(),
                         member("axes", i, "approach_overshoot"));
    require_finite(axis.home.radians(), member("axes", i, "home"));
    if (axis.home < axis.min - kAngleTolerance || axis.home > axis.max + kAngleTolerance) {
      refuse(member("axes", i, "home"), "is outside min and max");
    }
  }
}

void check_chain(const Chain& chain, const std::string& name, std::size_t axis_count) {
  for (std::size_t i = 0; i < chain.links.size(); ++i) {
    const ChainLink& link = chain.links[i];
    const std::string links = name + ".links";
    if (link.axis >= axis_count) {
      refuse(member(links, i, "axis"), "found " + std::to_string(link.axis) + ", but there are " +
                                           std::to_string(axis_count) + " axes");
    }
    if (!link.point_mm.allFinite()) refuse(member(links, i, "point_mm"), "is not finite");
    if (!(std::abs(link.direction.norm() - 1.0) <= kUnitTolerance)) {
      refuse(member(links, i, "direction"), "is not a unit vector");
    }
    require_finite(link.scale, member(links, i, "scale"));
    if (link.scale == 0.0) refuse(member(links, i, "scale"), "is 0");
    require_finite(link.offset.radians(), member(links, i, "offset"));
    require_finite(link.lead_mm_per_turn, member(links, i, "lead_mm_per_turn"));
  }
  const Eigen::Matrix3d rotation = chain.home_pose.linear();
  const bool orthonormal =
      (rotation * rotation.transpose() - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff() <=
          kUnitTolerance &&
      rotation.determinant() > 0.0;
  if (!orthonormal) refuse(name + ".home_pose", "is no rotation");
  if (!chain.home_pose.translation().allFinite()) refuse(name + ".home_pose", "is not finite");
}

void check_limits(const MeasurementLimits& limits) {
  const Angle right_angle = Angle::from_degrees(90.0);
  const auto check = [&](Angle angle, const std::string& field) {
    if (!(angle >= Angle() && angle <= right_angle)) {
      refuse("limits." + field,
             "found " + std::to_string(angle.degrees()) + " deg, expected 0 to 90");
    }
  };
  check(limits.theta_i_max, "theta_i_max");
  check(limits.theta_o_max, "theta_o_max");
  check(limits.theta_d_min, "theta_d_min");
  const FootprintLimits& f = limits.footprint;
  check(f.camera_half_field, "footprint.camera_half_field");
  require_not_negative(f.sample_half_width_mm, "limits.footprint.sample_half_width_mm");
  require_not_negative(f.edge_margin_mm, "limits.footprint.edge_margin_mm");
  require_not_negative(f.spot_half_width_mm, "limits.footprint.spot_half_width_mm");
  require_not_negative(f.min_projected_half_width_mm,
                       "limits.footprint.min_projected_half_width_mm");
  if (f.sample_half_width_mm > 0.0 && f.edge_margin_mm >= f.sample_half_width_mm) {
    refuse("limits.footprint.edge_margin_mm", "leaves nothing of the sample");
  }
}

void check_keep_outs(const std::vector<KeepOut>& keep_outs, std::size_t axis_count) {
  for (std::size_t i = 0; i < keep_outs.size(); ++i) {
    if (keep_outs[i].name.empty()) refuse(member("keep_outs", i, "name"), "is empty");
    if (keep_outs[i].ranges.empty()) {
      refuse(member("keep_outs", i, "ranges"), "found none, which would forbid every pose");
    }
    for (const KeepOut::Range& range : keep_outs[i].ranges) {
      if (range.axis >= axis_count) {
        refuse(member("keep_outs", i, "ranges.axis"), "found " + std::to_string(range.axis) +
                                                          ", but there are " +
                                                          std::to_string(axis_count) + " axes");
      }
      require_ordered(range.min, range.max, member("keep_outs", i, "ranges."));
    }
  }
}

}  // namespace

void RigDescription::validate() const {
  check_axes(axes);
  check_chain(camera, "camera", axes.size());
  check_chain(lamp, "lamp", axes.size());
  check_chain(sample, "sample", axes.size());
  check_limits(limits);
  check_keep_outs(keep_outs, axes.size());
}

Joints RigDescription::home() const {
  Joints joints;
  joints.reserve(axes.size());
  for (const Axis& axis : axes) joints.push_back(axis.home);
  return joints;
}

}  // namespace gonio::rig
