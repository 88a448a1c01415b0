#include "outputs.h"

#include <filesystem>
#include <vector>

#include "gonio/brdf/merl_file.h"
#include "gonio/console/failures.h"
#include "gonio/errors/errors.h"
#include "gonio/files/atomic_file.h"

namespace gonio::cli {

void require_replaceable_file(const std::filesystem::path& path) {
  if (!std::filesystem::exists(path) || std::filesystem::is_regular_file(path)) return;
  throw FileError(path, "replace", "it is not a regular file");
}

namespace {

/// A calibration's own files are what it holds; beside them there may be others.
void require_beside_calibration(const std::filesystem::path& out) {
  std::error_code ignored;
  const std::filesystem::path file = std::filesystem::weakly_canonical(out, ignored);
  const std::filesystem::path folder = file.parent_path().filename() == "raw"
                                           ? file.parent_path().parent_path()
                                           : file.parent_path();
  if (!std::filesystem::exists(folder / "calibration.json", ignored)) return;
  if (folder == file.parent_path() && file.filename() != "calibration.json" &&
      file.filename() != "instrument.json") {
    return;
  }
  throw UsageError(
      out.string() + ": is the calibration's in " + folder.string() + " and would be lost",
      "give another name to --out");
}

}  // namespace

void require_output(const std::string& out, bool force, std::initializer_list<std::string> inputs) {
  if (out == "-") throw UsageError("--out: found '-', expected the name of a file");
  std::error_code ignored;  // what does not exist is no input
  std::vector<std::filesystem::path> written{out};
  if (written[0].extension() == ".binary") written.push_back(brdf::merl_sidecar_path(out));
  for (const std::filesystem::path& each : written) {
    for (const std::string& input : inputs) {
      if (input.empty() || !std::filesystem::equivalent(each, input, ignored)) continue;
      throw UsageError(each.string() + ": is an input of this command and would be lost",
                       "give another name to --out");
    }
  }
  const std::filesystem::path folder =
      std::filesystem::weakly_canonical(out, ignored).parent_path();
  for (auto at = folder; at.has_relative_path(); at = at.parent_path()) {
    if (std::filesystem::exists(at / "session.sqlite", ignored)) {
      throw UsageError(out + ": lies inside the session archive " + at.string() +
                           ", where only a session writes",
                       "give a place outside of it to --out");
    }
  }
  require_beside_calibration(out);
  if (force) require_replaceable_file(out);
  files::require_creatable(out, force ? files::Overwrite::Yes : files::Overwrite::No);
}

}  // namespace gonio::cli
