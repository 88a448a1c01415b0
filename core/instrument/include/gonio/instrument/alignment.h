#pragma once

#include <Eigen/Core>
#include <chrono>
#include <filesystem>
#include <string>
#include <vector>

#include "gonio/files/atomic_file.h"
#include "gonio/instrument/instrument.h"

namespace gonio::instrument {

/// How one mounted sample lies on a calibrated rig.
struct Alignment {
  /// The sample's normal is z of the rig's sample frame turned by the rotation vector
  /// (tilt_x, tilt_y, 0).
  Angle tilt_x;
  Angle tilt_y;
  /// Of (tilt_x, tilt_y), rad^2, with what the rig's own normal is uncertain by.
  Eigen::Matrix2d covariance = Eigen::Matrix2d::Zero();
  std::string method;                ///< "highlight" or "seat"
  std::string sample;                ///< its id, one line; empty: not said
  std::string instrument_sha256;     ///< of the constants it was made with: to_json(Instrument)
  std::chrono::sys_seconds found{};  ///< when, UTC

  /// Throws std::invalid_argument naming the field: an angle beyond 20 deg, a covariance that is
  /// none or of sigmas outside 1e-5 to 10 deg, another method, a checksum that is none.
  void validate() const;
};

/// Longer than that nobody trusts a sample to lie as it did: what presses on it creeps, and the
/// axes are homed every day.
constexpr std::chrono::hours kAlignmentHolds{24};

/// Why a session of `sample` (empty: not said) should not use the alignment, one line each: another
/// sample's, too old or of a time to come. Empty when it may.
std::vector<std::string> reasons_against(const Alignment& alignment, const std::string& sample,
                                         std::chrono::sys_seconds now);

/// The instrument with the sample's frame on its true normal, and what is left uncertain of it.
/// The rotation is about the origin of the sample's frame.
Instrument aligned(const Instrument& instrument, const Alignment& alignment);

/// JSON, format "gonio-alignment" (docs/formats.md); numbers read back exactly.
std::string to_json(const Alignment& alignment);
/// Throws DataFormatError (path, key, found, expected).
Alignment alignment_from_json(const std::string& text, const std::filesystem::path& place);
Alignment read_alignment(const std::filesystem::path& path);
void write_alignment(const std::filesystem::path& path, const Alignment& alignment,
                     files::Overwrite overwrite = files::Overwrite::No);

}  // namespace gonio::instrument
