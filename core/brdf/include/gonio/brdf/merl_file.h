#pragma once

#include <filesystem>

#include "gonio/brdf/brdf_table.h"
#include "gonio/files/atomic_file.h"

namespace gonio::brdf {

/// Size of a MERL file: 3 x int32 (90, 90, 180), then R, G, B planes of little-endian float64.
constexpr std::uintmax_t kMerlFileBytes = 12 + 3 * lattice::kCells * 8;

/// Reads a MERL `.binary` file. A `X.json` sidecar beside it, when present, gives convention and
/// scale; otherwise bin centres and RadiometricScale::merl.
///
/// Throws   DataFormatError (path, byte offset, found, expected): cannot be opened, wrong size or
///          dimensions, a value that is NaN or infinite, no valid cell at all, broken sidecar.
BrdfTable read_merl(const std::filesystem::path& path);

/// Writes `X.binary` under a temporary name and renames it when it is whole.
void write_merl(const std::filesystem::path& path, const BrdfTable& table,
                files::Overwrite overwrite = files::Overwrite::No);

}  // namespace gonio::brdf
