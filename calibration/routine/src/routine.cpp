#include "gonio/calibration/routine/routine.h"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <stdexcept>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include "evaluated_again.h"
#include "gonio/calibration/result/step_refused.h"
#include "gonio/errors/errors.h"
#include "gonio/files/atomic_file.h"
#include "gonio/files/sha256.h"
#include "gonio/files/text_file.h"
#include "gonio/instrument/calibration_file.h"
#include "look.h"

namespace gonio::calibration::routine {
namespace {

constexpr std::size_t kMaxRawBytes = std::size_t{256} << 20U;

const instrument::CalibrationStep& step_named(const std::string& name) {
  const instrument::CalibrationStep* step = instrument::find_calibration_step(name);
  if (step == nullptr) throw std::invalid_argument("no calibration step is called " + name);
  return *step;
}

/// One line: every check that did not pass, with its figures.
void require_passed(const instrument::StepResult& result) {
  std::string failed;
  for (const instrument::AcceptanceCheck& check : result.checks) {
    if (check.passed()) continue;
    failed += fmt::format("{}{}: found {:.4g}, expected at most {:.4g}", failed.empty() ? "" : "; ",
                          check.name, check.found, check.limit);
  }
  if (failed.empty()) return;
  for (const std::string& note : result.notes) {
    if (note.starts_with("likely cause")) failed += "; " + note;
  }
  throw StepRefused(failed);
}

void give_up(instrument::CalibrationArchive& archive, const std::string& step) {
  std::erase_if(archive.results,
                [&](const instrument::StepResult& result) { return result.step == step; });
}

std::string map_text(const std::map<std::string, std::string>& map) {
  std::string text;
  for (const auto& [key, value] : map) {
    text += fmt::format("{}{} {}", text.empty() ? "" : ", ", key, value);
  }
  return text.empty() ? "none" : text;
}

/// Spots are means over neighbouring pixels, which a mosaic makes of different colours.
void require_mono(const devices::Camera& camera) {
  if (camera.info().pixel_format == devices::PixelFormat::mono) return;
  throw StepRefused(
      "camera: found a colour mosaic, expected pixel_format = mono: the routine calibrates mono "
      "cameras under a lamp of several channels");
}

}  // namespace

Observations read_observations(const instrument::StepResult& result, const Folder& folder) {
  if (result.raw_data.size() != 1) {
    throw DataFormatError(folder.archive(), result.step + ".raw_data",
                          fmt::format("found {} files, expected one", result.raw_data.size()));
  }
  const std::filesystem::path path = folder.raw(result.step, result.raw_data[0].sha256);
  if (!std::filesystem::exists(path)) {
    throw DataFormatError(path, "file",
                          fmt::format("found none, expected what step {} was made from; bring it "
                                      "back, or begin in another folder",
                                      result.step));
  }
  const std::string text = files::read_text_file(path, kMaxRawBytes);
  if (files::sha256_of_bytes(text) != result.raw_data[0].sha256) {
    throw DataFormatError(path, "contents",
                          fmt::format("are not what step {} was made from; take it again in "
                                      "another folder, or bring the file back",
                                      result.step));
  }
  return observations_from_json(text, result.step, path);
}

Routine::Routine(instrument::Instrument nominal, RoutineSettings settings, Folder folder,
                 std::map<std::string, std::string> serials,
                 std::function<instrument::UtcSeconds()> now)
    : nominal_(std::move(nominal)),
      settings_(std::move(settings)),
      folder_(std::move(folder)),
      now_(std::move(now)) {
  nominal_.validate();
  archive_.rig_sha256 = instrument::rig_sha256(nominal_);
  archive_.white_sha256 = instrument::white_sha256(nominal_.white);
  archive_.serials = std::move(serials);
  // What is seen would be written, and what is replaced removed, in somebody else's folder.
  if (std::filesystem::is_symlink(folder_.raw_folder())) {
    throw std::invalid_argument(
        fmt::format("{}: found a link, expected a folder of the calibration's own; link the whole "
                    "calibration instead",
                    folder_.raw_folder().string()));
  }
  if (std::filesystem::exists(folder_.archive())) read();
}

void Routine::read() {
  instrument::CalibrationArchive stored = instrument::read_calibration_archive(folder_.archive());
  if (stored.rig_sha256 != archive_.rig_sha256) {
    throw std::invalid_argument(fmt::format(
        "{}: was made on another rig or its rig file has changed since; begin in another folder",
        folder_.archive().string()));
  }
  if (stored.serials != archive_.serials) {
    throw std::invalid_argument(fmt::format(
        "{}: was made with other devices ({}), found {}; begin in another folder",
        folder_.archive().string(), map_text(stored.serials), map_text(archive_.serials)));
  }
  const std::vector<std::string> to_come = instrument::dates_to_come(stored, now_());
  if (!to_come.empty()) {
    throw std::invalid_argument(fmt::format("{}: {}", folder_.archive().string(), to_come.front()));
  }
  // The file stays as it is until a step is taken.
  mark_changed(stored);
  archive_ = std::move(stored);
  evaluate_known();
  if (notices_.empty() && !folder_.read_only) mend_constants();
}

void Routine::mark_changed(instrument::CalibrationArchive& stored) {
  if (stored.white_sha256 != archive_.white_sha256) {
    // What saw the white has to see it again, and what keeps its constants; what was made from that
    // is stale then.
    for (const char* step : {"flat_field", "stray_light", "white", "colour"}) {
      if (instrument::find_result(stored, step) != nullptr) stored.redo.insert(step);
    }
    stored.white_sha256 = archive_.white_sha256;
    notices_.emplace_back(
        "made with another white: flat_field, stray_light, white and colour have to be taken "
        "again");
  }
  keep_measured_board(stored, settings_);
  const instrument::TargetData told = target_data(settings_);
  for (const instrument::StepResult& result : stored.results) {
    std::string line = instrument::told_otherwise(result, told);
    if (line.empty() && settings_.temperature_deg_c) {
      line = instrument::at_another_temperature(result, *settings_.temperature_deg_c);
    }
    if (line.empty() || stored.redo.contains(result.step)) continue;
    stored.redo.insert(result.step);
    notices_.push_back(std::move(line));
  }
  if (!notices_.empty()) stored.instrument_sha256.clear();
}

void Routine::evaluate_known() {
  for (const instrument::CalibrationStep& step : instrument::calibration_steps()) {
    const std::string name(step.name);
    const instrument::StepResult* result = instrument::find_result(archive_, name);
    if (result == nullptr || state_of(name) == instrument::StepState::stale) continue;
    Findings findings = findings_;
    try {
      const Observations seen = read_observations(*result, folder_);
      last_homing_ = std::max(last_homing_, seen.homing);
      instrument::StepResult again = evaluate(name, seen, nominal_, settings_, findings);
      require_passed(again);
      findings_ = std::move(findings);
      if (same_numbers(again, *result)) continue;
      take_over_taking(*result, again);
      instrument::record(archive_, std::move(again));
      numbers_changed_ = true;
    } catch (const StepRefused& refused) {
      // With other settings, or by another version, it may not: then it has to be taken.
      archive_.redo.insert(name);
      notices_.push_back(fmt::format("{} does not pass any more and has to be taken again: {}",
                                     name, refused.what()));
    } catch (const std::invalid_argument& error) {
      throw DataFormatError(folder_.archive(), name, error.what());
    }
  }
}

void Routine::redo(const std::vector<std::string>& steps) {
  instrument::CalibrationArchive archive = archive_;
  bool any = false;
  for (const std::string& name : steps) {
    step_named(name);
    if (instrument::find_result(archive, name) == nullptr) continue;
    archive.redo.insert(name);
    any = true;
  }
  if (!any) return;
  // As store() does it, the archive first.
  archive.instrument_sha256.clear();
  instrument::write_calibration_archive(folder_.archive(), archive);
  write_constants({});
  archive_ = std::move(archive);
  findings_ = {};
  evaluate_known();
}

instrument::TargetData Routine::told_of(const instrument::CalibrationStep& step) const {
  const instrument::TargetData all = target_data(settings_);
  instrument::TargetData told;
  for (const std::string_view name : step.told) {
    const auto found = all.find(std::string(name));
    if (found != all.end()) told.insert(*found);
  }
  return told;
}

void Routine::mend_constants() {
  const std::string there = std::filesystem::exists(folder_.instrument())
                                ? files::sha256_of_file(folder_.instrument())
                                : std::string();
  if (there == archive_.instrument_sha256) {
    if (numbers_changed_) instrument::write_calibration_archive(folder_.archive(), archive_);
    return;
  }
  // As store() does it, the archive first: another version may come to other constants.
  const std::string constants = constants_of(archive_, findings_);
  archive_.instrument_sha256 = constants.empty() ? "" : files::sha256_of_bytes(constants);
  instrument::write_calibration_archive(folder_.archive(), archive_);
  write_constants(constants);
}

instrument::StepState Routine::state_of(const std::string& step) const {
  return instrument::state_of(archive_, step, now_());
}

instrument::Instrument Routine::instrument() const { return calibrated(nominal_, findings_); }

const instrument::StepResult& Routine::take(const std::string& name,
                                            const acquisition::DeviceSet& devices,
                                            const std::function<void(const Progress&)>& progress,
                                            std::stop_token stop) {
  const instrument::CalibrationStep& step = step_named(name);
  require_mono(*devices.camera);
  const std::map<std::string, std::string> inputs = instrument::inputs_of(archive_, name, now_());
  const instrument::Instrument known = instrument();
  rig::RigDescription rig = known.rig;
  if (name == "backlash") {
    for (rig::Axis& axis : rig.axes) axis.approach_overshoot = Angle();
  }
  std::vector<std::string> notes;
  Observations seen;
  if (name != "sample_plane") {
    acquisition::GuardedDevices guarded(
        devices, rig, settings_.session,
        [&](std::chrono::nanoseconds, const std::string& kind, const std::string& text) {
          notes.push_back(kind + ": " + text);
        },
        stop);
    if (homed_) {
      guarded.take_over();
    } else {
      guarded.home_all();
      homed_ = true;
      ++last_homing_;
    }
    Bench bench(guarded, known, settings_, [&](const std::string& what, double fraction) {
      if (progress) progress({name, what, fraction});
    });
    // It homes the axes many times, and may end in the middle: what others see is after that.
    if (name == "homing") ++last_homing_;
    seen = look(name, bench);
    seen.homing = last_homing_;
  }
  if (name == "stray_light") seen.constant = findings_.fields->constant;
  if (name == "colour") seen.constant = findings_.white->constant;
  Findings findings = findings_;
  instrument::StepResult result = evaluate(name, seen, nominal_, settings_, findings);
  result.notes.insert(result.notes.end(), notes.begin(), notes.end());
  require_passed(result);
  result.inputs = inputs;
  result.told = told_of(step);
  result.temperature_deg_c = settings_.temperature_deg_c;
  result.finished = now_();
  result.valid_until = result.finished + step.valid;
  const std::string text = to_json(name, seen);
  const std::string sha256 = files::sha256_of_bytes(text);
  const std::filesystem::path path = folder_.raw(name, sha256);
  result.raw_data = {{std::filesystem::relative(path, folder_.path).string(), sha256}};
  instrument::CalibrationArchive archive = archive_;
  instrument::record(archive, result);
  evaluate_borrowers(name, archive, findings, result.notes);
  instrument::record(archive, std::move(result));
  store(path, text, std::move(archive), std::move(findings));
  return *instrument::find_result(archive_, name);
}

void Routine::evaluate_borrowers(const std::string& taken, instrument::CalibrationArchive& archive,
                                 Findings& findings, std::vector<std::string>& notes) const {
  std::set<std::string_view> changed{taken};
  const auto any_changed = [&](const std::vector<std::string_view>& steps) {
    return std::any_of(steps.begin(), steps.end(),
                       [&](std::string_view step) { return changed.contains(step); });
  };
  for (const instrument::CalibrationStep& step : instrument::calibration_steps()) {
    const std::string name(step.name);
    const instrument::StepResult* old = instrument::find_result(archive, name);
    if (old == nullptr ||
        instrument::state_of(archive, name, now_()) == instrument::StepState::stale) {
      forget(name, findings);
      continue;
    }
    if (!(any_changed(step.needs) || any_changed(step.borrows))) continue;
    Findings tried = findings;
    try {
      instrument::StepResult again =
          evaluate(name, read_observations(*old, folder_), nominal_, settings_, tried);
      require_passed(again);
      take_over_taking(*old, again);
      instrument::record(archive, std::move(again));
      findings = std::move(tried);
    } catch (const StepRefused& refused) {
      notes.push_back(fmt::format("{}, evaluated again with this, has to be taken again: {}", name,
                                  refused.what()));
      give_up(archive, name);
      forget(name, findings);
    }
    changed.insert(step.name);
  }
}

std::string Routine::constants_of(const instrument::CalibrationArchive& archive,
                                  const Findings& findings) const {
  if (!instrument::is_whole(archive, now_())) return {};
  instrument::UtcSeconds last{};
  for (const instrument::StepResult& result : archive.results) {
    last = std::max(last, result.finished);
  }
  instrument::Instrument found = calibrated(nominal_, findings);
  found.id = fmt::format("{}, calibrated {:%F %H:%M} UTC", nominal_.rig.name, last);
  return instrument::calibrated_to_json(found);
}

void Routine::write_constants(const std::string& constants) const {
  if (constants.empty()) {
    std::filesystem::remove(folder_.instrument());
  } else {
    files::write_text_file(folder_.instrument(), constants, files::Overwrite::Yes);
  }
}

void Routine::store(const std::filesystem::path& raw, const std::string& text,
                    instrument::CalibrationArchive archive, Findings findings) {
  // What was seen comes first, under a name of its own, then the archive, last the constants, which
  // follow from it: killed at any moment, the archive names files that are there and as they were,
  // and constants that are not its own are seen by their checksum.
  const std::string constants = constants_of(archive, findings);
  archive.instrument_sha256 = constants.empty() ? "" : files::sha256_of_bytes(constants);
  std::filesystem::create_directories(raw.parent_path());
  files::write_text_file(raw, text, files::Overwrite::Yes);
  instrument::write_calibration_archive(folder_.archive(), archive);
  write_constants(constants);
  for (const instrument::StepResult& old : archive_.results) {
    const instrument::StepResult* now = instrument::find_result(archive, old.step);
    if (old.raw_data.size() != 1 ||
        (now != nullptr && now->raw_data[0].sha256 == old.raw_data[0].sha256)) {
      continue;
    }
    std::error_code ignored;  // a leftover does no harm
    std::filesystem::remove(folder_.raw(old.step, old.raw_data[0].sha256), ignored);
  }
  archive_ = std::move(archive);
  findings_ = std::move(findings);
}

}  // namespace gonio::calibration::routine
