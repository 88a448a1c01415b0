#include "gonio/rig/paths.h"

#include <algorithm>
#include <numeric>
#include <stdexcept>

namespace gonio::rig {
namespace {

struct Interval {
  Angle min, max;
};

constexpr std::size_t kMaxOrderedAxes = 6;  // 720 orders; more axes go by way of home only

Interval travelled(const Axis& axis, Angle from, Angle to) {
  return {std::min(from, to) - (from > to ? overshoot(axis, from, to) : Angle()),
          std::max(from, to)};
}

/// Name of a keep-out that shares a point with the box, widened by `margin` on all sides.
std::optional<std::string> keep_out_touching(const RigDescription& rig,
                                             const std::vector<Interval>& box, Angle margin) {
  for (const KeepOut& keep_out : rig.keep_outs) {
    const bool touched = std::all_of(keep_out.ranges.begin(), keep_out.ranges.end(),
                                     [&](const KeepOut::Range& range) {
                                       return box[range.axis].max + margin >= range.min &&
                                              box[range.axis].min - margin <= range.max;
                                     });
    if (touched) return keep_out.name;
  }
  return std::nullopt;
}

void check_sizes(const RigDescription& rig, const Joints& joints) {
  if (joints.size() != rig.axes.size()) {
    throw std::invalid_argument("paths: found " + std::to_string(joints.size()) +
                                " joint angles, expected " + std::to_string(rig.axes.size()));
  }
}

std::vector<Interval> point_box(const Joints& joints) {
  std::vector<Interval> box;
  box.reserve(joints.size());
  for (const Angle joint : joints) box.push_back({joint, joint});
  return box;
}

/// The poses between two, when the axes move one after another in this order; empty when a leg is
/// not clear. The target is not listed.
std::optional<std::vector<Joints>> axis_by_axis(const RigDescription& rig, const Joints& from,
                                                const Joints& to, Angle margin,
                                                const std::vector<std::size_t>& order) {
  std::vector<Joints> stops;
  Joints at = from;
  for (const std::size_t axis : order) {
    if (at[axis] == to[axis]) continue;
    Joints next = at;
    next[axis] = to[axis];
    if (!path_is_clear(rig, at, next, margin)) return std::nullopt;
    stops.push_back(next);
    at = next;
  }
  if (!stops.empty()) stops.pop_back();
  return stops;
}

std::optional<std::vector<Joints>> direct_or_axis_by_axis(const RigDescription& rig,
                                                          const Joints& from, const Joints& to,
                                                          Angle margin) {
  if (path_is_clear(rig, from, to, margin)) return std::vector<Joints>{};
  if (rig.axes.size() > kMaxOrderedAxes) return std::nullopt;
  std::vector<std::size_t> order(rig.axes.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  do {
    if (auto stops = axis_by_axis(rig, from, to, margin, order)) return stops;
  } while (std::next_permutation(order.begin(), order.end()));
  return std::nullopt;
}

}  // namespace

std::optional<std::string> keep_out_at(const RigDescription& rig, const Joints& joints,
                                       Angle margin) {
  check_sizes(rig, joints);
  return keep_out_touching(rig, point_box(joints), margin);
}

Angle overshoot(const Axis& axis, Angle from, Angle target) {
  if (target >= from) return Angle();
  return std::clamp(target - axis.min, Angle(), axis.approach_overshoot);
}

std::optional<std::string> keep_out_between(const RigDescription& rig, const Joints& from,
                                            const Joints& to, Angle margin) {
  check_sizes(rig, from);
  check_sizes(rig, to);
  if (rig.keep_outs.empty()) return std::nullopt;
  std::vector<Interval> box = point_box(from);
  for (std::size_t k = 0; k < rig.axes.size(); ++k) {
    box[k] = travelled(rig.axes[k], from[k], to[k]);
    if (rig.simultaneous_axes) continue;
    if (auto name = keep_out_touching(rig, box, margin)) return name;
    box[k] = {to[k], to[k]};
  }
  return keep_out_touching(rig, box, margin);
}

bool path_is_clear(const RigDescription& rig, const Joints& from, const Joints& to, Angle margin) {
  return !keep_out_between(rig, from, to, margin).has_value();
}

std::optional<std::vector<Joints>> way_around(const RigDescription& rig, const Joints& from,
                                              const Joints& to, Angle margin) {
  if (auto stops = direct_or_axis_by_axis(rig, from, to, margin)) return stops;
  const Joints home = rig.home();
  auto there = direct_or_axis_by_axis(rig, from, home, margin);
  const auto back = direct_or_axis_by_axis(rig, home, to, margin);
  if (!there || !back) return std::nullopt;
  there->push_back(home);
  there->insert(there->end(), back->begin(), back->end());
  return there;
}

}  // namespace gonio::rig
