#include "gonio/setup/rig_file.h"
#include "plan_file.h"
#include "trial.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  return gonio::fuzz::trial(data, size, [](const auto& path) {
    static const gonio::cli::RigFile rig = gonio::cli::default_rig_file();
    if (gonio::cli::has_poses(path, rig.rig)) gonio::cli::read_poses(path, rig.rig);
  });
}
