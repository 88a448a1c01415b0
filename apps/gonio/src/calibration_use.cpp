#include "calibration_use.h"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <algorithm>
#include <chrono>

#include "gonio/files/sha256.h"
#include "gonio/instrument/calibration_archive.h"
#include "gonio/setup/simulated_rig.h"

namespace gonio::cli {

std::optional<CalibrationUse> calibration_in_use(const RigFile& rig,
                                                 const std::string& calibration) {
  const std::filesystem::path folder = calibration_place(rig, calibration);
  if (folder.empty() || !std::filesystem::is_directory(folder)) return std::nullopt;
  const std::filesystem::path file = folder / "calibration.json";
  const instrument::CalibrationArchive archive = instrument::read_calibration_archive(file);
  CalibrationUse use;
  use.serials = archive.serials;
  // The devices are not open yet: compare_serials() is for later.
  use.reasons = instrument::reasons_against(
      archive, {instrument::rig_sha256(nominal_instrument(rig).rig), archive.serials,
                std::chrono::floor<std::chrono::seconds>(std::chrono::system_clock::now())});
  const std::filesystem::path constants = folder / "instrument.json";
  if (!archive.instrument_sha256.empty() &&
      files::sha256_of_file(constants) != archive.instrument_sha256) {
    use.reasons.push_back(constants.string() +
                          ": is not what the calibration came to; take its steps again");
  }
  instrument::UtcSeconds until = instrument::UtcSeconds::max();
  for (const instrument::StepResult& result : archive.results) {
    until = std::min(until, result.valid_until);
  }
  use.metadata["calibration_archive_sha256"] = files::sha256_of_file(file);
  if (!archive.results.empty()) {
    use.metadata["calibration_valid_until_utc"] = fmt::format("{:%FT%TZ}", until);
  }
  return use;
}

void compare_serials(CalibrationUse& use, const std::map<std::string, std::string>& found) {
  for (const auto& [device, identity] : use.serials) {
    const auto here = found.find(device);
    if (here == found.end()) {
      use.reasons.push_back(
          fmt::format("{}: the calibration knows it as {}, it is not here", device, identity));
    } else if (here->second != identity) {
      use.reasons.push_back(fmt::format("{}: found {}, the calibration was made with {}", device,
                                        here->second, identity));
    }
  }
}

}  // namespace gonio::cli
