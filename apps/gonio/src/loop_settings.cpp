#include "loop_settings.h"

#include <fmt/format.h>

#include <charconv>
#include <filesystem>

#include "gonio/acquisition/decisions.h"
#include "gonio/basis/basis_file.h"
#include "gonio/basis/siblings.h"
#include "gonio/console/failures.h"
#include "gonio/errors/errors.h"
#include "provenance.h"
#include "samples_input.h"

namespace gonio::cli {
namespace {

using acquisition::SessionReader;

constexpr const char* kBasisKey = "loop_basis";
constexpr const char* kFingerprintKey = "loop_basis_fingerprint";
constexpr const char* kUntilKey = "loop_until_db";
constexpr const char* kMaxPointsKey = "loop_max_points";

template <class Number>
Number number_of(const SessionReader& archive, const char* key, const std::string& text, Number min,
                 Number max) {
  Number value{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || !(value >= min && value <= max)) {
    throw DataFormatError(archive.folder(), std::string("metadata ") + key,
                          fmt::format("found {:?}, expected {} to {}", text, min, max));
  }
  return value;
}

std::string text_of(const SessionReader& archive, const char* key) {
  const auto found = archive.metadata().find(key);
  return found == archive.metadata().end() ? std::string() : found->second;
}

}  // namespace

LoopSettings loop_settings(const std::string& basis_path, std::optional<double> until_db,
                           int max_points, brdf::RadiometricScale scale,
                           const std::string& fingerprint) {
  LoopSettings settings;
  settings.basis = std::make_shared<const basis::Basis>(basis::read_basis(basis_path));
  require_scale_of(*settings.basis, basis_path, scale, "this session");
  if (!fingerprint.empty() && basis_fingerprint(*settings.basis) != fingerprint) {
    throw UsageError(fmt::format("{}: is not the basis the session was begun with (its "
                                 "fingerprint was {:.12})",
                                 basis_path, fingerprint),
                     "put that one back, or begin a new session");
  }
  const std::size_t groups = basis::count_groups(settings.basis->materials);
  if (until_db && groups < basis::kFewestGroups) {
    throw UsageError(
        fmt::format("--until: {} has {} materials (siblings counted once), too few to "
                    "foresee an error ({} at least)",
                    basis_path, groups, basis::kFewestGroups));
  }
  settings.basis_path = std::filesystem::absolute(basis_path).lexically_normal().string();
  settings.until_db = until_db;
  settings.max_points = max_points;
  return settings;
}

acquisition::SessionMetadata loop_metadata(const LoopSettings& settings) {
  acquisition::SessionMetadata metadata{{kBasisKey, settings.basis_path},
                                        {kFingerprintKey, basis_fingerprint(*settings.basis)},
                                        {kMaxPointsKey, std::to_string(settings.max_points)}};
  if (settings.until_db) metadata[kUntilKey] = fmt::format("{}", *settings.until_db);
  return metadata;
}

std::optional<LoopSettings> stored_loop(const SessionReader& archive, brdf::RadiometricScale scale,
                                        const std::string& basis_path) {
  const std::string stored_path = text_of(archive, kBasisKey);
  if (stored_path.empty()) return std::nullopt;
  if (basis_path.empty() && !std::filesystem::exists(stored_path)) {
    throw UsageError(
        fmt::format("{}: its basis is no longer at {}", archive.folder().string(), stored_path),
        "--basis FILE says where it is now");
  }
  const std::string& path = basis_path.empty() ? stored_path : basis_path;
  const std::string until = text_of(archive, kUntilKey);
  std::optional<double> until_db;
  if (!until.empty()) until_db = number_of(archive, kUntilKey, until, 0.0, 100.0);
  const int max_points = number_of(archive, kMaxPointsKey, text_of(archive, kMaxPointsKey), 1,
                                   acquisition::kMostPoints);
  const std::string fingerprint = text_of(archive, kFingerprintKey);
  if (fingerprint.empty()) {
    throw DataFormatError(archive.folder(), std::string("metadata ") + kFingerprintKey, "missing");
  }
  return loop_settings(path, until_db, max_points, scale, fingerprint);
}

acquisition::Check loop_check(const LoopSettings& settings) {
  std::string text = fmt::format(
      "on, with {}: points that fail are replaced, more are added where the material "
      "or a point asks for them",
      settings.basis_path);
  if (settings.until_db) {
    text += fmt::format(", until a picture of it is expected at {:g} dB", *settings.until_db);
  }
  return {"loop", acquisition::CheckResult::pass,
          text + fmt::format(", {} points at most", settings.max_points)};
}

}  // namespace gonio::cli
