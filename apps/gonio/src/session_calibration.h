#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "gonio/acquisition/session_archive.h"
#include "gonio/instrument/calibration_archive.h"
#include "gonio/setup/rig_file.h"

namespace gonio::cli {

/// A calibration folder that a session is to use.
struct SessionCalibration {
  std::filesystem::path folder;
  instrument::CalibrationArchive archive;
  /// This session; its serials once the devices are open.
  instrument::CalibrationUse use;
  std::optional<std::string> changed;  ///< why the constants are not the archive's
  acquisition::SessionMetadata metadata;

  /// Why the session should not: expired, stale, incomplete, of another rig or devices; one line
  /// each.
  std::vector<std::string> reasons() const;
  /// Throws UsageError with the reasons, if there are any.
  void require_usable() const;
  /// One line for a person, as calibration_text().
  std::string text() const;
};

/// "FOLDER, valid until 2026-11-28 20:53 UTC, expired: white, warm_up" from the metadata of a
/// session: how things stood when it began. Bare constants: their id and that they have no age.
std::string calibration_text(const acquisition::SessionMetadata& metadata);

/// Why a session with this metadata should not be gone on with at `now`, one line each: what it was
/// begun with has grown too old since. Throws std::invalid_argument for a date that is none.
std::vector<std::string> grown_old(const acquisition::SessionMetadata& metadata,
                                   instrument::UtcSeconds now);

/// The calibration named on the command line, else in the rig file; none when that is no folder:
/// bare constants have no age and no origin. Throws DataFormatError, FileError.
std::optional<SessionCalibration> session_calibration(const RigFile& rig,
                                                      const std::string& calibration);

}  // namespace gonio::cli
