#pragma once

#include <cstddef>
#include <filesystem>
#include <vector>

#include "gonio/files/atomic_file.h"
#include "gonio/render/image.h"

namespace gonio::render {

/// A PNG file's bytes: 8-bit RGB when every pixel is opaque, RGBA otherwise, marked sRGB. No time
/// stamp: the same picture gives the same bytes on one machine.
/// Throws std::runtime_error with libpng's reason.
std::vector<std::byte> encode_png(const Image& image);

/// The same as a file that appears when it is whole. Throws FileError.
void write_png(const std::filesystem::path& path, const Image& image,
               files::Overwrite overwrite = files::Overwrite::No);

}  // namespace gonio::render
