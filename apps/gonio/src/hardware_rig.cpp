#include "gonio/console/failures.h"
#include "opened_rig.h"

namespace gonio::cli {

std::unique_ptr<OpenedRig> open_hardware_rig(const RigFile& rig, Parts) {
  throw UsageError(rig.path.string() + ": rig.driver: this program has no drivers built in");
}

std::vector<std::string> stop_hardware_rig(const RigFile& rig) {
  return {rig.path.string() + ": this program has no drivers built in"};
}

}  // namespace gonio::cli
