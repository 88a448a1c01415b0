#pragma once

#include <optional>
#include <string>
#include <vector>

#include "gonio/acquisition/session_archive.h"
#include "gonio/instrument/calibration_archive.h"
#include "gonio/setup/rig_file.h"

namespace gonio::cli {

/// A calibration folder that a session is to use.
struct SessionCalibration {
  instrument::CalibrationArchive archive;
  /// This session; its serials once the devices are open.
  instrument::CalibrationUse use;
  std::optional<std::string> changed;  ///< why the constants are not the archive's
  acquisition::SessionMetadata metadata;

  /// Why the session should not: expired, stale, incomplete, of another rig or devices; one line
  /// each.
  std::vector<std::string> reasons() const;
};

/// The calibration named on the command line, else in the rig file; none when that is no folder:
/// bare constants have no age and no origin. Throws DataFormatError, FileError.
std::optional<SessionCalibration> session_calibration(const RigFile& rig,
                                                      const std::string& calibration);

}  // namespace gonio::cli
