#pragma once

#include <filesystem>

#include "gonio/rig/rig_description.h"

namespace gonio::cli {

/// The rig of a calibration file as far as the rig file allows it too. The kinematics are the
/// calibration's. Of travel, speed, acceleration and measurement limits the narrower of the two is
/// taken, of settling times and overshoots the longer; keep-outs of both hold; axes move together
/// only where both allow it. A limit that the rig file leaves at its default counts as well.
///
/// Both descriptions are valid. Throws UsageError (one line, both files, key): other axes, another
/// home, footprint limits that leave nothing of the sample.
rig::RigDescription narrower_rig(const rig::RigDescription& calibrated,
                                 const std::filesystem::path& calibration,
                                 const rig::RigDescription& allowed,
                                 const std::filesystem::path& rig_file);

}  // namespace gonio::cli
