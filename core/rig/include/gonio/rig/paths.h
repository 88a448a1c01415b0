#pragma once

#include <optional>
#include <string>
#include <vector>

#include "gonio/rig/rig_description.h"

namespace gonio::rig {

/// How far poses and ways are planned to stay away from keep-outs. On the rig axes start from where
/// the encoders say they stand, not from where they were sent: far above what that differs by, far
/// below what a keep-out is known to.
constexpr Angle kPlanningMargin = Angle::from_degrees(0.05);

/// Name of a keep-out that holds the joints or a point less than `margin` from them along each
/// axis, if any. Borders belong to the keep-out.
std::optional<std::string> keep_out_at(const RigDescription& rig, const Joints& joints,
                                       Angle margin = {});

/// Name of a keep-out that a move from one pose to another may touch, if any.
///
/// Axes that travel together finish at different times, and their timing is the drives' affair: so
/// the whole box between the two poses is taken, with the overshoot of one-sided approaches.
/// Where axes move one at a time, the box of each leg, in the order of RigDescription::axes; each
/// axis ends its approach before the next begins. `margin` widens every box on all sides.
std::optional<std::string> keep_out_between(const RigDescription& rig, const Joints& from,
                                            const Joints& to, Angle margin = {});

/// True when no keep-out lies between (see keep_out_between()).
bool path_is_clear(const RigDescription& rig, const Joints& from, const Joints& to,
                   Angle margin = {});

/// How far a move to `target` first goes below it: the axis' approach overshoot for a falling
/// move, cut off at the lower limit; 0 for a rising one.
Angle overshoot(const Axis& axis, Angle from, Angle target);

/// Stops to make between two poses so that every leg is clear: none for a clear direct move;
/// otherwise axis by axis in some order, otherwise by way of the home pose. The target itself is
/// not listed. Nothing when no such detour is clear by `margin`.
std::optional<std::vector<Joints>> way_around(const RigDescription& rig, const Joints& from,
                                              const Joints& to, Angle margin = {});

}  // namespace gonio::rig
