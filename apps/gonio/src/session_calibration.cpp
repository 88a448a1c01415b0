#include "session_calibration.h"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <algorithm>
#include <chrono>

#include "gonio/files/sha256.h"
#include "gonio/setup/simulated_rig.h"

namespace gonio::cli {

std::vector<std::string> SessionCalibration::reasons() const {
  std::vector<std::string> all = instrument::reasons_against(archive, use);
  if (changed) all.push_back(*changed);
  return all;
}

std::optional<SessionCalibration> session_calibration(const RigFile& rig,
                                                      const std::string& calibration) {
  const std::filesystem::path folder = calibration_place(rig, calibration);
  if (folder.empty() || !std::filesystem::is_directory(folder)) return std::nullopt;
  const std::filesystem::path file = folder / "calibration.json";
  SessionCalibration session;
  session.archive = instrument::read_calibration_archive(file);
  session.use = {instrument::rig_sha256(nominal_instrument(rig).rig), std::nullopt,
                 std::chrono::floor<std::chrono::seconds>(std::chrono::system_clock::now())};
  const std::filesystem::path constants = folder / "instrument.json";
  if (!session.archive.instrument_sha256.empty() &&
      files::sha256_of_file(constants) != session.archive.instrument_sha256) {
    session.changed =
        constants.string() + ": is not what the calibration came to; take its steps again";
  }
  instrument::UtcSeconds until = instrument::UtcSeconds::max();
  for (const instrument::StepResult& result : session.archive.results) {
    until = std::min(until, result.valid_until);
  }
  session.metadata["calibration_archive_sha256"] = files::sha256_of_file(file);
  if (!session.archive.results.empty()) {
    session.metadata["calibration_valid_until_utc"] = fmt::format("{:%FT%TZ}", until);
  }
  return session;
}

}  // namespace gonio::cli
