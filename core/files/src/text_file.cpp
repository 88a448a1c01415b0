#include "gonio/files/text_file.h"

#include <unistd.h>

#include <algorithm>
#include <cerrno>

#include "gonio/errors/errors.h"
#include "posix.h"

namespace gonio::files {

std::string read_text_file(const std::filesystem::path& path, std::size_t max_bytes) {
  constexpr std::size_t kChunk = std::size_t{1} << 16U;
  const posix::Descriptor file(posix::open_for_reading(path));
  std::string text;
  while (true) {
    const std::size_t had = text.size();
    // One byte more than allowed tells a file that is too long from one that just fits.
    text.resize(had + std::min(kChunk, max_bytes - had + 1));
    const ssize_t count = ::read(file.get(), text.data() + had, text.size() - had);
    const int error = errno;
    text.resize(had + static_cast<std::size_t>(std::max<ssize_t>(count, 0)));
    if (count == 0) return text;
    if (count < 0 && error != EINTR) throw FileError(path, "read", error);
    if (text.size() > max_bytes) {
      throw DataFormatError(
          path, "byte " + std::to_string(max_bytes),
          "found more data, expected at most " + std::to_string(max_bytes) + " bytes");
    }
  }
}

}  // namespace gonio::files
