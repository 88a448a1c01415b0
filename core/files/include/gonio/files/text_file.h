#pragma once

#include <cstddef>
#include <filesystem>
#include <string>

namespace gonio::files {

/// Limit for configuration, plans and samples: far above any real one, far below the memory.
constexpr std::size_t kMaxTextBytes = std::size_t{256} << 20U;

/// The whole file, byte for byte.
/// Throws   FileError when it cannot be read or is no regular file (InputFile); DataFormatError
/// when
///          it has more than `max_bytes`, found by reading, so that a file that grows is refused
///          too.
std::string read_text_file(const std::filesystem::path& path,
                           std::size_t max_bytes = kMaxTextBytes);

}  // namespace gonio::files
