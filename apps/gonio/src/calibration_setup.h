#pragma once

#include <map>
#include <string>

#include "gonio/calibration/routine/settings.h"
#include "gonio/opened_rig/opened_rig.h"
#include "gonio/setup/rig_file.h"

namespace gonio::cli {

/// What the operator of a rig knows of targets and efforts: from its file, and on a simulated or
/// emulated rig the certificates of its targets.
calibration::routine::RoutineSettings calibration_settings(const RigFile& rig);

/// Who the devices are, as a calibration keeps it: device -> what it says of itself.
std::map<std::string, std::string> serials_of(OpenedRig& rig);

}  // namespace gonio::cli
