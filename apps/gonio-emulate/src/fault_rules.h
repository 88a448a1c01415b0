#pragma once

#include <string>
#include <vector>

#include "gonio/emulator_faults/fault_plan.h"
#include "gonio/setup/rig_file.h"

namespace gonio::emulate {

/// Fault rules as the command line writes them. Throws cli::UsageError for text that is no rule, a
/// device the rig does not have, and a fault that the device, or with none named every device of
/// the rig, cannot show.
std::vector<emulator_faults::FaultRule> fault_rules(const std::vector<std::string>& texts,
                                                    const cli::RigFile& rig);

}  // namespace gonio::emulate
