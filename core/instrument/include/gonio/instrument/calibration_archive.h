#pragma once

#include <Eigen/Core>
#include <chrono>
#include <filesystem>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "gonio/instrument/acceptance_check.h"
#include "gonio/instrument/calibration_step.h"
#include "gonio/instrument/instrument.h"
#include "gonio/instrument/utc_time.h"

namespace gonio::instrument {

/// What the operator says of targets: "mirror_raised_mm" -> "0.5". Names are those of the rig
/// file's [targets], and "colour_chart" with the SHA-256 of its certificate.
using TargetData = std::map<std::string, std::string>;

struct CalibrationParameter {
  std::string name;  ///< "camera.fx_px"
  std::string unit;  ///< "px"; empty for a ratio
  double value = 0.0;
};

/// A file the result was made from.
struct RawData {
  std::string file;  ///< relative to the archive's folder
  std::string sha256;
};

/// The result of one step that was accepted.
struct StepResult {
  std::string step;  ///< name of a CalibrationStep
  UtcSeconds finished{};
  UtcSeconds valid_until{};
  std::optional<double> temperature_deg_c;    ///< of the room, where it was told
  std::map<std::string, std::string> inputs;  ///< step -> taking_sha256() of the result it used
  /// With what was told of the targets: of CalibrationStep::told what was known then.
  TargetData told;
  std::vector<CalibrationParameter> parameters;
  Eigen::MatrixXd covariance;               ///< of the parameters, in their order and units
  std::map<std::string, double> residuals;  ///< named statistics: "reprojection_rms_px"
  std::vector<AcceptanceCheck> checks;      ///< all passed
  std::vector<RawData> raw_data;
  std::vector<std::string> notes;

  /// Throws std::invalid_argument naming the field: an unknown step, inputs that are not exactly
  /// what the step needs, something told that it does not use, a check that did not pass,
  /// parameters named twice, numbers that are not finite, a covariance of another size, not
  /// symmetric or not positive semidefinite, a validity that ends before it begins, a checksum that
  /// is none.
  void validate() const;
};

/// All that a calibration has found, with how sure it is, from what and until when.
struct CalibrationArchive {
  std::string rig_sha256;    ///< rig_sha256() of the nominal instrument
  std::string white_sha256;  ///< white_sha256() of the certificate the white was seen with
  /// Of the file of constants (calibration_file.h) that the results came to; empty while a step is
  /// missing or stale.
  std::string instrument_sha256;
  std::map<std::string, std::string> serials;  ///< device -> serial number or identity
  std::vector<StepResult> results;             ///< at most one of a step
  /// Steps whose result somebody wants anew, or what it was made with has changed: stale until they
  /// are taken.
  std::set<std::string> redo;

  /// Throws std::invalid_argument naming the result: as StepResult::validate(), a step twice, one
  /// to redo that is none, a device without identity.
  void validate() const;
};

/// Where a step stands.
enum class StepState {
  missing,
  valid,
  stale,   ///< what it was made from has changed or is gone since
  expired  ///< older than it may be
};

std::string_view to_string(StepState state);

/// Of what a rig file says of rig, camera, sensor, lens and lamp, as a number in the archive: 64
/// hexadecimal digits. The white, its uncertainties and the id do not count.
std::string rig_sha256(const Instrument& nominal);
/// Of a white and its certificate, as rig_sha256().
std::string white_sha256(const WhiteReference& white);

/// Of what was seen and when, not of the numbers it came to: those are had again with what other
/// steps find later.
std::string taking_sha256(const StepResult& result);

/// Null when the step has no result.
const StepResult* find_result(const CalibrationArchive& archive, std::string_view step);

/// A result is stale when it is to be redone, and as soon as one that it needs was taken anew, is
/// missing or stale itself: what rests on it needs no mark. One it borrows from makes nothing
/// stale. Throws std::invalid_argument for a step that is none.
StepState state_of(const CalibrationArchive& archive, std::string_view step, UtcSeconds now);

/// Every step has a result that is not stale. One that has expired is known, but not for a new
/// session.
bool is_whole(const CalibrationArchive& archive, UtcSeconds now);

/// Steps that have to be repeated, in order.
std::vector<std::string> steps_to_take(const CalibrationArchive& archive, UtcSeconds now);

/// The hashes a new result of `step` has to name. Throws std::invalid_argument when one of the
/// steps it needs or borrows from has no valid result: which, and why.
std::map<std::string, std::string> inputs_of(const CalibrationArchive& archive,
                                             std::string_view step, UtcSeconds now);

/// Whether `steps`, in order, can be taken one after the other: throws std::invalid_argument as
/// inputs_of() will for the first that cannot, for what earlier ones make stale as well.
void require_takeable(const CalibrationArchive& archive, const std::vector<std::string>& steps,
                      UtcSeconds now);

/// Why a result was made with other targets than `now` says, one line; empty when it was not. What
/// `now` does not name is not compared.
std::string told_otherwise(const StepResult& result, const TargetData& now);

/// Why a result does not hold in a room of that temperature, one line; empty: it holds, or what it
/// found does not follow the temperature, or its own is not known. Dark current doubles every 6 to
/// 8 K: darks hold within 3 K.
std::string at_another_temperature(const StepResult& result, double now_deg_c);

/// Of each result that is said to be taken later than now, beyond what clocks differ by, one line:
/// a date that is wrong says nothing of its age.
std::vector<std::string> dates_to_come(const CalibrationArchive& archive, UtcSeconds now);

/// Puts a result in the place of the older one of its step, which is redone with that. Throws as
/// StepResult::validate(); the archive then is as it was.
void record(CalibrationArchive& archive, StepResult result);

/// What a session is told besides the archive.
struct CalibrationUse {
  std::string rig_sha256;
  std::string white_sha256;
  /// Of all devices that are there, as in the archive; an empty map says that none is. Without a
  /// map they are not known yet, as before devices are opened: nothing is said about them then.
  std::optional<std::map<std::string, std::string>> serials;
  UtcSeconds now{};
  TargetData told = {};  ///< what is not named is not compared
};

/// Why a session should not use the archive, one line each: made on another rig, with another
/// white, with other targets, with devices that are others, not there or not known, steps missing,
/// stale, expired or of a time to come, and what to do. Empty when it may.
std::vector<std::string> reasons_against(const CalibrationArchive& archive,
                                         const CalibrationUse& use);

/// JSON, format "gonio-calibration-archive" (docs/formats.md); numbers read back exactly.
std::string to_json(const CalibrationArchive& archive);

/// Throws DataFormatError (path, key, found, expected), as instrument_from_json().
CalibrationArchive calibration_archive_from_json(const std::string& text,
                                                 const std::filesystem::path& place);
CalibrationArchive read_calibration_archive(const std::filesystem::path& path);
/// Replaces the file as a whole: a crash leaves the old one.
void write_calibration_archive(const std::filesystem::path& path,
                               const CalibrationArchive& archive);

}  // namespace gonio::instrument
