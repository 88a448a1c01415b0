#include "regular_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <string>
#include <utility>

#include "gonio/errors/errors.h"

namespace gonio::brdf {
namespace {

/// Non-blocking, so that a pipe without a writer is refused instead of waited for. The flag does
/// nothing to regular files.
int open_for_reading(const std::filesystem::path& path) {
  return ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
}

}  // namespace

RegularFile::RegularFile(const std::filesystem::path& path)
    : RegularFile(path, open_for_reading(path)) {}

RegularFile::RegularFile(const std::filesystem::path& path, int descriptor)
    : path_(path), descriptor_(descriptor) {
  if (descriptor_ < 0) throw FileError(path_, "open for reading", errno);
  struct stat status {};
  const bool known = ::fstat(descriptor_, &status) == 0;
  const int error = errno;
  if (known && S_ISREG(status.st_mode)) {
    size_ = static_cast<std::uintmax_t>(status.st_size);
    return;
  }
  ::close(descriptor_);  // the destructor does not run
  if (!known) throw FileError(path_, "read", error);
  throw DataFormatError(path_, "byte 0",
                        std::string("found a ") +
                            (S_ISDIR(status.st_mode) ? "folder" : "pipe, socket or device") +
                            ", expected a regular file");
}

RegularFile::~RegularFile() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

RegularFile::RegularFile(RegularFile&& other) noexcept
    : path_(std::move(other.path_)),
      descriptor_(std::exchange(other.descriptor_, -1)),
      size_(other.size_),
      offset_(other.offset_) {}

std::optional<RegularFile> RegularFile::open_if_exists(const std::filesystem::path& path) {
  const int descriptor = open_for_reading(path);
  if (descriptor < 0 && errno == ENOENT) return std::nullopt;
  return RegularFile(path, descriptor);
}

void RegularFile::read(std::span<std::byte> bytes) {
  while (!bytes.empty()) {
    const ssize_t count = ::read(descriptor_, bytes.data(), bytes.size());
    if (count < 0) {
      const int error = errno;
      if (error == EINTR) continue;
      throw FileError(path_, "read", error);
    }
    if (count == 0) {
      throw DataFormatError(
          path_, "byte " + std::to_string(offset_),
          "the file ends here, expected " + std::to_string(bytes.size()) + " more bytes");
    }
    offset_ += static_cast<std::uintmax_t>(count);
    bytes = bytes.subspan(static_cast<std::size_t>(count));
  }
}

}  // namespace gonio::brdf
