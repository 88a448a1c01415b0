#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

#include "gonio/brdf/brdf_table.h"
#include "gonio/files/atomic_file.h"

namespace gonio::brdf {

/// Size of a MERL file: 3 x int32 (90, 90, 180), then R, G, B planes of little-endian float64.
constexpr std::uintmax_t kMerlFileBytes = 12 + 3 * lattice::kCells * 8;

/// Reads a MERL `.binary` file. A sidecar beside it, when present, gives convention and scale;
/// otherwise bin centres and RadiometricScale::merl.
///
/// The sidecar must have been written for exactly these bytes (it holds their SHA-256): a file
/// copied over another, or a crash between the two renames of write_merl(), is found out here
/// instead of giving numbers in the wrong unit.
///
/// Throws   FileError when a file cannot be opened or read, or is no regular file. DataFormatError
///          (path, byte offset or key, found, expected): wrong size or dimensions, a value that is
///          NaN or infinite, no valid cell above the horizon, broken or foreign sidecar.
/// Cost     One pass over 35 MB; with a sidecar also their SHA-256.
BrdfTable read_merl(const std::filesystem::path& path);

/// The SHA-256 that `X.binary` will have, 64 hexadecimal digits: for what is to point to it and
/// must stand before it does.
std::string merl_sha256(const BrdfTable& table);

/// Writes `X.binary` and its sidecar `X.json`, both under temporary names first, made durable
/// before either gets its name. The sidecar gets it before the binary does, so a crash leaves
/// either a pair that belongs together or one that read_merl() refuses.
///
/// `provenance_json`  What made the table: one JSON object, free in form, kept as it is.
/// Throws   FileError when either file cannot be written or exists and may not be replaced (a
///          sidecar without its binary, left by a crash, may); std::invalid_argument when a stored
///          number is not finite, no cell above the horizon is valid, or `provenance_json` is not
///          an object. The old files stand as they were then; only when the folder cannot be
///          synced after the last rename the new pair stands already, whole.
void write_merl(const std::filesystem::path& path, const BrdfTable& table,
                files::Overwrite overwrite = files::Overwrite::No,
                std::string_view provenance_json = "{}");

/// What stands beside a `.binary` file (docs/formats.md).
struct MerlSidecar {
  IndexConvention convention;
  RadiometricScale scale;
  std::string binary_sha256;    ///< 64 lower-case hexadecimal digits
  std::string provenance_json;  ///< one JSON object
};

/// `X.json` for `X.binary`; for any other name `.json` is appended.
std::filesystem::path merl_sidecar_path(const std::filesystem::path& binary);

/// The sidecar of a `.binary` file, nothing when there is none. Does not look at the binary.
/// Throws   As read_merl().
std::optional<MerlSidecar> read_merl_sidecar(const std::filesystem::path& binary);

}  // namespace gonio::brdf
