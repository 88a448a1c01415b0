#pragma once

#include <memory>
#include <optional>
#include <string>

#include "gonio/acquisition/preflight.h"
#include "gonio/acquisition/session_archive.h"
#include "gonio/brdf/brdf_table.h"

namespace gonio::basis {
struct Basis;
}

namespace gonio::cli {

/// What is given for the closed loop of a session, and stored with it.
struct LoopSettings {
  std::shared_ptr<const basis::Basis> basis;
  std::string basis_path;          ///< absolute
  std::optional<double> until_db;  ///< foreseen score of a picture at which to stop
  int max_points = 40;             ///< with those of the plan; a longer plan is measured whole
};

/// Reads the basis. Throws UsageError unless it is in the session's scale, has materials enough to
/// foresee a score (for `until_db`), and, where `fingerprint` is not empty, is the one of it.
LoopSettings loop_settings(const std::string& basis_path, std::optional<double> until_db,
                           int max_points, brdf::RadiometricScale scale,
                           const std::string& fingerprint = "");

/// "loop_..." of a session's metadata.
acquisition::SessionMetadata loop_metadata(const LoopSettings& settings);

/// The settings that metadata tell; nothing for a session without a loop. `basis_path`: where the
/// basis is now; empty: where it was. Throws DataFormatError for what loop_metadata() does not
/// write, UsageError when the basis is not there or no longer the same.
std::optional<LoopSettings> stored_loop(const acquisition::SessionReader& archive,
                                        brdf::RadiometricScale scale,
                                        const std::string& basis_path);

/// One line for the preflight.
acquisition::Check loop_check(const LoopSettings& settings);

}  // namespace gonio::cli
