#pragma once

#include <optional>
#include <string>
#include <vector>

#include "gonio/modbus_stage/drive_profile.h"
#include "gonio/setup/rig_file.h"

namespace gonio::cli {

/// Stops a rig of metal whose program has died: opens the ports of its axes and its lamp, all at
/// the same time, stops the axes and closes the shutter.
///
/// State    Knows all it needs once constructed: files may be gone when it acts. Opens nothing
/// before
///          stop().
/// Threads  One.
class RigStopper {
 public:
  /// Throws as drive_profile() does.
  explicit RigStopper(RigFile rig);

  /// What does not work at once, a port still held or a silent device, is tried again for some
  /// seconds. Returns one line for every device that could not be stopped.
  std::vector<std::string> stop() const;

  const std::string& rig_name() const { return rig_.rig.name; }

 private:
  RigFile rig_;
  std::vector<std::optional<modbus_stage::DriveProfile>> profiles_;  ///< of the axes on Modbus
};

}  // namespace gonio::cli
