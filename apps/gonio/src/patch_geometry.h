#pragma once

#include <optional>
#include <string>

#include "gonio/design/patch_geometry.h"
#include "gonio/design/pose_information.h"
#include "gonio/rig/rig_description.h"
#include "gonio/setup/simulated_rig.h"

namespace gonio::cli {

/// From the sample's centre to camera and lamp, all axes at home.
double camera_distance_mm(const rig::RigDescription& rig);
double lamp_distance_mm(const rig::RigDescription& rig);

/// What one frame of the rig shows of a sample: the patch whose squares have their centres where
/// `reduce` puts its spots, at the distances its constants tell.
design::PatchGeometry patch_of(const KnownRig& rig);

/// From the word of --patch: "auto" is the rig's own (+-25 mm without one), a number the half width
/// of the sample in mm, 0 points. `rig` may be null. Throws UsageError.
design::PatchGeometry planned_patch(const std::string& word, const KnownRig* rig);

/// "points", "patches of +-25 mm (3 x 3)".
std::string to_text(const design::PatchGeometry& patch);

/// Errors to plan for: common to a frame what the rig's constants say (`rig` may be null),
/// independent `relative` where given; else the defaults.
design::PoseNoise planned_noise(const KnownRig* rig, std::optional<double> relative = {});

}  // namespace gonio::cli
