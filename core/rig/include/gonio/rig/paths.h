#pragma once

#include <optional>
#include <string>
#include <vector>

#include "gonio/rig/rig_description.h"

namespace gonio::rig {

/// Name of the keep-out that holds the joints, if any. Borders belong to the keep-out.
std::optional<std::string> keep_out_at(const RigDescription& rig, const Joints& joints);

/// Name of a keep-out that a move from one pose to another may touch, if any.
///
/// Axes that travel together finish at different times, and their timing is the drives' affair: so
/// the whole box between the two poses is taken, with the overshoot of one-sided approaches.
/// Where axes move one at a time, the box of each leg, in the order of RigDescription::axes.
std::optional<std::string> keep_out_between(const RigDescription& rig, const Joints& from,
                                            const Joints& to);

/// True when no keep-out lies between (see keep_out_between()).
bool path_is_clear(const RigDescription& rig, const Joints& from, const Joints& to);

/// How far a move to `target` first goes below it: the axis' approach overshoot for a falling
/// move, cut off at the lower limit; 0 for a rising one.
Angle overshoot(const Axis& axis, Angle from, Angle target);

/// Stops to make between two poses so that every leg is clear: none for a clear direct move;
/// otherwise axis by axis in some order, otherwise by way of the home pose. The target itself is
/// not listed. Nothing when no such detour is clear.
std::optional<std::vector<Joints>> way_around(const RigDescription& rig, const Joints& from,
                                              const Joints& to);

}  // namespace gonio::rig
