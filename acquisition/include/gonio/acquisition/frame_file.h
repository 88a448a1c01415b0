#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "gonio/devices/frame.h"
#include "gonio/files/atomic_file.h"

namespace gonio::acquisition {

/// Writes 16-bit pixels as an uncompressed grey TIFF, complete and synced under `path` or not at
/// all. Returns the file's SHA-256. Throws FileError.
std::string write_frame_file(const std::filesystem::path& path, const devices::Frame& frame,
                             files::Overwrite overwrite = files::Overwrite::No);

/// Pixels of such a file. Throws DataFormatError unless it is `width_px` x `height_px`, one sample
/// of 16 bit per pixel.
std::vector<std::uint16_t> read_frame_file(const std::filesystem::path& path, int width_px,
                                           int height_px);

}  // namespace gonio::acquisition
