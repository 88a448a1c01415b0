#include "gonio/files/text_file.h"

#include <algorithm>
#include <span>

#include "gonio/errors/errors.h"
#include "gonio/files/input_file.h"

namespace gonio::files {

std::string read_text_file(const std::filesystem::path& path, std::size_t max_bytes) {
  constexpr std::size_t kChunk = std::size_t{1} << 16U;
  InputFile file(path);
  std::string text;
  while (true) {
    const std::size_t had = text.size();
    // One byte more than allowed tells a file that is too long from one that just fits.
    text.resize(had + std::min(kChunk, max_bytes - had + 1));
    const std::size_t count = file.read_some(std::as_writable_bytes(std::span(text).subspan(had)));
    text.resize(had + count);
    if (count == 0) return text;
    if (text.size() > max_bytes) {
      throw DataFormatError(
          path, "byte " + std::to_string(max_bytes),
          "found more data, expected at most " + std::to_string(max_bytes) + " bytes");
    }
  }
}

}  // namespace gonio::files
