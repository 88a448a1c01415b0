#include "session_calibration.h"

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <chrono>
#include <ctime>

#include "gonio/errors/errors.h"
#include "gonio/files/sha256.h"
#include "gonio/instrument/alignment.h"
#include "gonio/setup/calibration_settings.h"
#include "gonio/setup/simulated_rig.h"

namespace gonio::cli {
namespace {

/// "expired: white, warm_up; missing: colour"; empty when all steps are valid.
std::string open_steps(const instrument::CalibrationArchive& archive, instrument::UtcSeconds now) {
  using instrument::StepState;
  std::string text;
  for (const StepState state : {StepState::expired, StepState::stale, StepState::missing}) {
    std::vector<std::string_view> names;
    for (const auto& step : instrument::calibration_steps()) {
      if (instrument::state_of(archive, step.name, now) == state) names.push_back(step.name);
    }
    if (names.empty()) continue;
    text += fmt::format("{}{}: {}", text.empty() ? "" : "; ", instrument::to_string(state),
                        fmt::join(names, ", "));
  }
  return text;
}

}  // namespace

std::vector<std::string> SessionCalibration::reasons() const {
  std::vector<std::string> all = instrument::reasons_against(archive, use);
  if (changed) all.push_back(*changed);
  return all;
}

void SessionCalibration::require_usable() const {
  const std::vector<std::string> against = reasons();
  if (against.empty()) return;
  throw UsageError(fmt::format("calibration: {}", fmt::join(against, "; ")),
                   "gonio calibrate takes the steps again; --accept-calibration goes on all the "
                   "same");
}

std::string SessionCalibration::text() const { return calibration_text(metadata); }

std::string calibration_text(const acquisition::SessionMetadata& metadata) {
  const auto value = [&](const char* key) {
    const auto found = metadata.find(key);
    return found == metadata.end() ? std::string() : found->second;
  };
  if (value("calibration_archive_sha256").empty()) {
    const std::string id = value("calibration");
    return (id.empty() ? "constants" : id) + ", from no calibration folder: without age";
  }
  const std::string folder = value("calibration_folder");
  std::string text = folder.empty() ? value("calibration") : folder;
  const std::string until = value("calibration_valid_until_utc");
  if (!until.empty()) text += ", valid until " + until;
  const std::string open = value("calibration_open_steps");
  if (!open.empty()) text += ", " + open;
  return text;
}

std::vector<std::string> grown_old(const acquisition::SessionMetadata& metadata,
                                   instrument::UtcSeconds now) {
  // What was accepted as too old when the session began is so now.
  const auto date = [&](const char* key, const char* accepted) {
    const auto found = metadata.find(key);
    if (found == metadata.end() || metadata.contains(accepted)) {
      return std::optional<instrument::UtcSeconds>();
    }
    std::tm parts{};
    const char* const end = ::strptime(found->second.c_str(), "%Y-%m-%dT%H:%M:%SZ", &parts);
    if (end == nullptr || *end != '\0') {
      throw std::invalid_argument(
          fmt::format("{}: found {:?}, expected a time", key, found->second));
    }
    return std::optional(instrument::UtcSeconds(std::chrono::seconds(::timegm(&parts))));
  };
  std::vector<std::string> reasons;
  // A clock that was set back says of nothing how old it is.
  if (const auto began = date("provenance_started_utc", "")) {
    const std::string to_come = instrument::time_to_come(*began, now);
    if (!to_come.empty()) reasons.push_back("its beginning: " + to_come);
  }
  const auto until = date("calibration_valid_until_utc", "calibration_accepted_despite");
  if (until && now > *until) {
    reasons.push_back(fmt::format("its calibration was valid until {:%Y-%m-%d %H:%M} UTC", *until));
  }
  const auto aligned = date("alignment_found_utc", "alignment_accepted_despite");
  if (aligned) {
    const std::string to_come = instrument::time_to_come(*aligned, now);
    if (!to_come.empty()) reasons.push_back("its alignment: " + to_come);
  }
  if (aligned && now > *aligned + instrument::kAlignmentHolds) {
    reasons.push_back(
        fmt::format("its alignment is of {:%Y-%m-%d %H:%M} UTC, expected one of the last {} hours",
                    *aligned, instrument::kAlignmentHolds.count()));
  }
  return reasons;
}

std::optional<SessionCalibration> session_calibration(const RigFile& rig,
                                                      const std::string& calibration) {
  const std::filesystem::path folder = calibration_place(rig, calibration);
  if (folder.empty() || !std::filesystem::is_directory(folder)) return std::nullopt;
  const std::filesystem::path file = folder / "calibration.json";
  SessionCalibration session;
  session.folder = folder;
  session.archive = instrument::read_calibration_archive(file);
  const instrument::Instrument nominal = nominal_instrument(rig);
  session.use = {instrument::rig_sha256(nominal), instrument::white_sha256(nominal.white),
                 std::nullopt,
                 std::chrono::floor<std::chrono::seconds>(std::chrono::system_clock::now()),
                 calibration::routine::target_data(calibration_settings(rig))};
  const std::filesystem::path constants = folder / "instrument.json";
  if (files::sha256_of_file(constants) != session.archive.instrument_sha256) {
    session.changed = constants.string() +
                      ": is not what the calibration came to; gonio calibrate writes it again";
  }
  instrument::UtcSeconds until = instrument::UtcSeconds::max();
  for (const instrument::StepResult& result : session.archive.results) {
    until = std::min(until, result.valid_until);
  }
  session.metadata["calibration_archive_sha256"] = files::sha256_of_file(file);
  if (!session.archive.results.empty()) {
    session.metadata["calibration_valid_until_utc"] = fmt::format("{:%FT%TZ}", until);
  }
  session.metadata["calibration_folder"] = folder.string();
  const std::string open = open_steps(session.archive, session.use.now);
  if (!open.empty()) session.metadata["calibration_open_steps"] = open;
  return session;
}

}  // namespace gonio::cli
