#pragma once

#include "gonio/calibration/routine/settings.h"
#include "gonio/setup/rig_file.h"

namespace gonio::cli {

/// What the operator of a rig knows of targets and efforts: from its file, and on a simulated or
/// emulated rig the certificates of its targets.
calibration::routine::RoutineSettings calibration_settings(const RigFile& rig);

}  // namespace gonio::cli
