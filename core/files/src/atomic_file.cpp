#include "gonio/files/atomic_file.h"

#include <fcntl.h>
#include <sys/types.h>
#include <unistd.h>

#include <cerrno>
#include <stdexcept>
#include <utility>

#include "gonio/errors/errors.h"
#include "posix.h"

namespace gonio::files {

void require_creatable(const std::filesystem::path& target, Overwrite overwrite) {
  const bool is_folder = std::filesystem::is_directory(std::filesystem::symlink_status(target));
  posix::require_replaceable(target, overwrite,
                             is_folder ? posix::Kind::Folder : posix::Kind::File);
  // Permissions, read-only mounts and quotas: creating something is the only test of all of them.
  int descriptor = -1;
  const std::filesystem::path probe = posix::create_hidden_file(target, descriptor);
  ::close(descriptor);
  ::unlink(probe.c_str());
}

AtomicFile::AtomicFile(std::filesystem::path target, Overwrite overwrite)
    : target_(std::move(target)), overwrite_(overwrite) {
  posix::require_replaceable(target_, overwrite_, posix::Kind::File);
  temporary_ = posix::create_hidden_file(target_, descriptor_);
}

AtomicFile::~AtomicFile() {
  if (descriptor_ < 0) return;
  ::close(descriptor_);
  ::unlink(temporary_.c_str());
}

void AtomicFile::require_room(std::uintmax_t bytes) {
  if (descriptor_ < 0) throw std::logic_error("AtomicFile: require_room() after commit()");
  const auto length = static_cast<off_t>(bytes);
  int error = ::ftruncate(descriptor_, length) == 0 ? 0 : errno;
  if (error == 0 && length > 0) {
    error = ::fallocate(descriptor_, 0, 0, length) == 0 ? 0 : errno;
    if (error == EOPNOTSUPP || error == ENOSYS) error = 0;  // a file system that cannot tell
  }
  if (::ftruncate(descriptor_, 0) != 0 && error == 0) error = errno;
  if (error != 0) throw FileError(target_, "write", error);
}

void AtomicFile::write(std::span<const std::byte> bytes) {
  if (descriptor_ < 0) throw std::logic_error("AtomicFile: write() after commit()");
  while (!bytes.empty()) {
    const ssize_t written = ::write(descriptor_, bytes.data(), bytes.size());
    if (written < 0) {
      if (errno == EINTR) continue;
      throw FileError(target_, "write", errno);
    }
    bytes = bytes.subspan(static_cast<std::size_t>(written));
  }
}

void AtomicFile::write(std::string_view text) { write(std::as_bytes(std::span(text))); }

void AtomicFile::prepare() {
  if (descriptor_ < 0) throw std::logic_error("AtomicFile: prepare() after commit()");
  make_durable();
  posix::sync(posix::parent_of(target_));
}

void AtomicFile::make_durable() const {
  // By name, not by our descriptor: a library may have replaced the file it was given.
  posix::sync(temporary_);
  posix::require_replaceable(target_, overwrite_, posix::Kind::File);
}

void AtomicFile::commit() {
  if (descriptor_ < 0) throw std::logic_error("AtomicFile: commit() called twice");
  make_durable();
  if (overwrite_ == Overwrite::Yes) {
    if (::rename(temporary_.c_str(), target_.c_str()) != 0) {
      throw FileError(target_, "create", errno);
    }
  } else {
    posix::rename_to_free_name(temporary_, target_);
  }
  ::close(std::exchange(descriptor_, -1));
  posix::sync(posix::parent_of(target_));
}

void write_text_file(const std::filesystem::path& target, std::string_view text,
                     Overwrite overwrite) {
  AtomicFile file(target, overwrite);
  file.write(text);
  file.commit();
}

}  // namespace gonio::files
