#include "gonio/files/input_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <string>
#include <utility>

#include "gonio/errors/errors.h"

namespace gonio::files {
namespace {

/// Non-blocking, so that a pipe without a writer is refused instead of waited for, and without
/// making a terminal ours. Neither flag does anything to regular files.
int open_for_reading(const std::filesystem::path& path) {
  return ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOCTTY);
}

const char* kind_of(mode_t mode) {
  if (S_ISDIR(mode)) return "a folder";
  if (S_ISFIFO(mode)) return "a pipe";
  return "a device";  // a socket cannot be opened
}

}  // namespace

InputFile::InputFile(const std::filesystem::path& path) : InputFile(path, open_for_reading(path)) {}

InputFile::InputFile(const std::filesystem::path& path, int descriptor)
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
  throw FileError(path_, "read",
                  std::string("found ") + kind_of(status.st_mode) + ", expected a regular file");
}

InputFile::~InputFile() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

InputFile::InputFile(InputFile&& other) noexcept
    : path_(std::move(other.path_)),
      descriptor_(std::exchange(other.descriptor_, -1)),
      size_(other.size_),
      offset_(other.offset_) {}

std::optional<InputFile> InputFile::open_if_exists(const std::filesystem::path& path) {
  const int descriptor = open_for_reading(path);
  if (descriptor < 0 && errno == ENOENT) return std::nullopt;
  return InputFile(path, descriptor);
}

std::size_t InputFile::read_some(std::span<std::byte> bytes) {
  while (true) {
    const ssize_t count =
        ::pread(descriptor_, bytes.data(), bytes.size(), static_cast<off_t>(offset_));
    const int error = errno;
    if (count >= 0) {
      offset_ += static_cast<std::uintmax_t>(count);
      return static_cast<std::size_t>(count);
    }
    if (error != EINTR) throw FileError(path_, "read", error);
  }
}

void InputFile::read(std::span<std::byte> bytes) {
  while (!bytes.empty()) {
    const std::size_t count = read_some(bytes);
    if (count == 0) {
      throw DataFormatError(
          path_, "byte " + std::to_string(offset_),
          "the file ends here, expected " + std::to_string(bytes.size()) + " more bytes");
    }
    bytes = bytes.subspan(count);
  }
}

void InputFile::read_at(std::uintmax_t offset, std::span<std::byte> bytes) {
  offset_ = offset;
  read(bytes);
}

void require_regular_file(const std::filesystem::path& path) { const InputFile file(path); }

}  // namespace gonio::files
