#include "gonio/calibration/routine/routine.h"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>
#include <system_error>
#include <utility>
#include <vector>

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
  if (stored.white_sha256 != archive_.white_sha256) {
    // What saw the white has to see it again; what was made from that is stale without it.
    std::erase_if(stored.results, [](const instrument::StepResult& result) {
      return result.step == "flat_field" || result.step == "white";
    });
    stored.white_sha256 = archive_.white_sha256;
    stored.instrument_sha256.clear();
  }
  archive_ = std::move(stored);
  for (const instrument::CalibrationStep& step : instrument::calibration_steps()) {
    const std::string name(step.name);
    const instrument::StepResult* result = instrument::find_result(archive_, name);
    if (result == nullptr || state_of(name) != instrument::StepState::valid) continue;
    evaluate(name, read_observations(*result, folder_), nominal_, settings_, findings_);
  }
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
    }
    Bench bench(guarded, known, settings_, [&](const std::string& what, double fraction) {
      if (progress) progress({name, what, fraction});
    });
    seen = look(name, bench);
  }
  Findings findings = findings_;
  instrument::StepResult result = evaluate(name, seen, nominal_, settings_, findings);
  result.notes.insert(result.notes.end(), notes.begin(), notes.end());
  require_passed(result);
  result.inputs = inputs;
  result.finished = now_();
  result.valid_until = result.finished + step.valid;
  store(name, seen, std::move(result), std::move(findings));
  return *instrument::find_result(archive_, name);
}

void Routine::store(const std::string& step, const Observations& observations,
                    instrument::StepResult result, Findings findings) {
  // What was seen comes first, under a name of its own: killed at any moment, the archive names
  // files that are there and as they were.
  const std::string text = to_json(step, observations);
  const std::string sha256 = files::sha256_of_bytes(text);
  const std::filesystem::path path = folder_.raw(step, sha256);
  std::filesystem::create_directories(path.parent_path());
  result.raw_data = {{std::filesystem::relative(path, folder_.path).string(), sha256}};
  instrument::CalibrationArchive archive = archive_;
  instrument::record(archive, std::move(result));
  // The constants that sessions use go with the archive as a whole: with a step missing or stale
  // there are none.
  archive.instrument_sha256.clear();
  std::string constants;
  if (instrument::steps_to_take(archive, now_()).empty()) {
    instrument::Instrument found = calibrated(nominal_, findings);
    found.id = fmt::format("{}, calibrated {:%F %H:%M} UTC", nominal_.rig.name, now_());
    constants = instrument::to_json(found);
    archive.instrument_sha256 = files::sha256_of_bytes(constants);
  }
  files::write_text_file(path, text, files::Overwrite::Yes);
  if (!constants.empty()) {
    files::write_text_file(folder_.instrument(), constants, files::Overwrite::Yes);
  }
  instrument::write_calibration_archive(folder_.archive(), archive);
  if (const instrument::StepResult* old = instrument::find_result(archive_, step);
      old != nullptr && old->raw_data.size() == 1 && old->raw_data[0].sha256 != sha256) {
    std::error_code ignored;  // a leftover does no harm
    std::filesystem::remove(folder_.raw(step, old->raw_data[0].sha256), ignored);
  }
  archive_ = std::move(archive);
  findings_ = std::move(findings);
}

}  // namespace gonio::calibration::routine
