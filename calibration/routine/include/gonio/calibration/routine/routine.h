#pragma once

#include <chrono>
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "gonio/acquisition/session.h"
#include "gonio/calibration/routine/findings.h"
#include "gonio/calibration/routine/settings.h"
#include "gonio/instrument/calibration_archive.h"

namespace gonio::calibration::routine {

/// What a step tells while it runs; called on the routine's thread.
struct Progress {
  std::string step;
  std::string what;  ///< "view 12 of 35"
  double fraction = 0.0;
};

/// Names and files of one calibration folder.
///
///   calibration.json   the archive (instrument::CalibrationArchive)
///   instrument.json    the constants sessions use; there is none while a step is missing or stale
///   raw/STEP-HASH.json what the step saw (Observations), by the first digits of its SHA-256
struct Folder {
  std::filesystem::path path;
  /// Nothing is written when it is opened: another process may be at work in it, whose newer
  /// archive must not be written over with an older one.
  bool read_only = false;
  std::filesystem::path archive() const { return path / "calibration.json"; }
  std::filesystem::path instrument() const { return path / "instrument.json"; }
  std::filesystem::path raw_folder() const { return path / "raw"; }
  std::filesystem::path raw(const std::string& step, const std::string& sha256) const {
    return raw_folder() / (step + "-" + sha256.substr(0, 12) + ".json");
  }
};

/// What a result was made from. Throws FileError; DataFormatError for another number of files than
/// one, or contents that are not those the result names.
Observations read_observations(const instrument::StepResult& result, const Folder& folder);

/// Takes calibration steps one by one, and keeps what they find.
///
/// State    A folder that exists is gone on with: results that are not stale are read and evaluated
///          again from what their steps saw, in seconds; those that have expired are known, if not
///          for a new session. What was made with another white or other targets, or does not pass
///          any more, counts as stale, which notices() tells; the file says so once a step is
///          taken. Constants that are not the archive's, as a kill between two writes leaves them,
///          are written again, and so are numbers that are not what the steps saw. A step that is
///          refused or stopped leaves folder and findings as they were. Findings are those of the
///          results that are not stale, no others.
/// Threads  One; a stop request from any thread stops the axes at once.
class Routine {
 public:
  /// `nominal`  The instrument as designed, with the white's certificate. `serials` as in
  ///            CalibrationArchive; `now` is the time of day, for validity.
  /// Throws std::invalid_argument: a folder of another rig or other devices, naming both, results
  /// of a time to come, raw data behind a link; DataFormatError: a corrupt archive, or observations
  /// that are not those it names.
  Routine(instrument::Instrument nominal, RoutineSettings settings, Folder folder,
          std::map<std::string, std::string> serials, std::function<instrument::UtcSeconds()> now);

  const instrument::CalibrationArchive& archive() const { return archive_; }
  const Findings& findings() const { return findings_; }
  const RoutineSettings& settings() const { return settings_; }
  /// With all that was found so far.
  instrument::Instrument instrument() const;
  /// What of the folder cannot be used as it is, one line each.
  const std::vector<std::string>& notices() const { return notices_; }

  /// Marks results as to be redone, in the folder as well, before anything is looked at: whatever
  /// ends the program from now on, they and what rests on them are stale until they are taken.
  /// Throws std::invalid_argument for a step that is none, FileError.
  void redo(const std::vector<std::string>& steps);

  /// Takes one step: mounts its target, looks, evaluates, stores. Homes the axes first unless
  /// they were homed by this object. What later steps that borrow from it saw is evaluated again;
  /// one that no longer passes is given up, and the result's notes say so.
  /// Throws StepRefused: not good enough, saying what to do; nothing was stored.
  /// std::invalid_argument: no such step, or one it needs has no valid result.
  /// devices::DeviceError, acquisition::PreflightError as the devices.
  const instrument::StepResult& take(const std::string& step, const acquisition::DeviceSet& devices,
                                     const std::function<void(const Progress&)>& progress,
                                     std::stop_token stop);

  /// Where steps stand at this moment.
  instrument::StepState state_of(const std::string& step) const;

 private:
  void read();
  void mark_changed(instrument::CalibrationArchive& stored);
  void evaluate_known();
  /// Later results with what `taken` has come to by now, in archive and findings.
  void evaluate_borrowers(const std::string& taken, instrument::CalibrationArchive& archive,
                          Findings& findings, std::vector<std::string>& notes) const;
  instrument::TargetData told_of(const instrument::CalibrationStep& step) const;
  void store(const std::filesystem::path& raw, const std::string& text,
             instrument::CalibrationArchive archive, Findings findings);
  /// Empty while a step is missing or stale.
  std::string constants_of(const instrument::CalibrationArchive& archive,
                           const Findings& findings) const;
  void write_constants(const std::string& constants) const;  ///< empty: there are none
  void mend_constants();

  instrument::Instrument nominal_;
  RoutineSettings settings_;
  Folder folder_;
  std::function<instrument::UtcSeconds()> now_;
  instrument::CalibrationArchive archive_;
  Findings findings_;
  int last_homing_ = 0;  ///< the largest Observations::homing of the folder
  std::vector<std::string> notices_;
  bool homed_ = false;
  bool numbers_changed_ = false;  ///< the file's are not those that its raw data come to
};

}  // namespace gonio::calibration::routine
