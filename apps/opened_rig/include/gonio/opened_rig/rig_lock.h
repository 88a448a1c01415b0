#pragma once

#include <filesystem>
#include <vector>

#include "gonio/files/process_lock.h"
#include "gonio/opened_rig/opened_rig.h"
#include "gonio/setup/rig_file.h"

namespace gonio::cli {

/// Holds the devices of a rig of metal against other processes, whoever's and from whatever rig
/// file: one lock per bus or device on its own, named by its address. In an emulated machine those
/// of that machine alone.
class RigLock {
 public:
  /// Locks lie in `folder`; empty: in that of the machine, /run/lock, else the user's runtime
  /// folder, else that of temporary files. Waits for a watchdog that still stops the rig of a dead
  /// process. Throws UsageError naming the device and the process that uses it, FileError.
  RigLock(const RigFile& rig, Parts parts, const std::filesystem::path& folder = {});

  /// For a watchdog to hold as well.
  std::vector<int> descriptors() const;

 private:
  std::vector<files::ProcessLock> locks_;
};

}  // namespace gonio::cli
