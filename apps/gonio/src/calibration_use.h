#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "gonio/acquisition/session_archive.h"
#include "gonio/setup/rig_file.h"

namespace gonio::cli {

/// A calibration folder that a session is to use.
struct CalibrationUse {
  /// Why it should not: expired, stale, incomplete, of another rig; one line each.
  std::vector<std::string> reasons;
  std::map<std::string, std::string> serials;  ///< of the devices it was made with
  acquisition::SessionMetadata metadata;       ///< what a session stores of it
};

/// The calibration named on the command line, else in the rig file; none when that is no folder:
/// bare constants have no age and no origin. Throws DataFormatError, FileError.
std::optional<CalibrationUse> calibration_in_use(const RigFile& rig,
                                                 const std::string& calibration);

/// One more reason where the devices are others than the calibration's.
void compare_serials(CalibrationUse& use, const std::map<std::string, std::string>& found);

}  // namespace gonio::cli
