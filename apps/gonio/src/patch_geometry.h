#pragma once

#include <string>

#include "gonio/design/patch_geometry.h"
#include "gonio/design/pose_information.h"
#include "rig_file.h"

namespace gonio::cli {

/// What one frame of the rig shows of a sample: the patch whose squares have their centres where
/// `reduce` puts its spots.
design::PatchGeometry patch_of(const RigFile& rig);

/// From the word of --patch: "auto" is the rig's own (+-25 mm without one), a number the half width
/// of the sample in mm, 0 points. Throws UsageError.
design::PatchGeometry planned_patch(const std::string& word, const RigFile* rig);

/// "points", "patches of +-25 mm (3 x 3)".
std::string to_text(const design::PatchGeometry& patch);

/// Errors to plan for: common to a frame what the rig's constants say, else the default.
design::PoseNoise planned_noise(const RigFile* rig);

}  // namespace gonio::cli
