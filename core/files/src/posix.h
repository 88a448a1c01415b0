#pragma once

#include <filesystem>

#include "gonio/files/atomic_file.h"

/// The system calls behind AtomicFile and AtomicFolder, with errors as FileError.
namespace gonio::files::posix {

/// A descriptor that closes itself.
class Descriptor {
 public:
  explicit Descriptor(int value) : value_(value) {}
  ~Descriptor();
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  int get() const noexcept { return value_; }

 private:
  int value_;
};

/// The folder `path` lies in; "." for a bare name.
std::filesystem::path parent_of(const std::filesystem::path& path);

/// A name beside `target` that nobody used a moment ago: ".NAME.PID-N.part".
std::filesystem::path hidden_sibling(const std::filesystem::path& target);

enum class Kind { File, Folder };

/// Throws unless `target` is free, or may be replaced and is of the given kind.
void require_replaceable(const std::filesystem::path& target, Overwrite overwrite, Kind kind);

/// Creates an empty hidden file or folder beside `target`. Returns its path; `descriptor`, when
/// not null, receives the file open for writing.
std::filesystem::path create_hidden_file(const std::filesystem::path& target, int& descriptor);
std::filesystem::path create_hidden_folder(const std::filesystem::path& target);

/// Makes the contents of a file, or the names in a folder, survive a power cut.
void sync(const std::filesystem::path& path);

/// Renames in one step without ever replacing; throws when `to` exists.
void rename_to_free_name(const std::filesystem::path& from, const std::filesystem::path& to);

/// Lets two folders change places in one step. False when the file system cannot.
bool exchange(const std::filesystem::path& one, const std::filesystem::path& other);

}  // namespace gonio::files::posix
