#include "recorded_disk.h"

#include <fcntl.h>
#include <sqlite3.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <memory>
#include <optional>
#include <random>
#include <set>
#include <sstream>
#include <utility>

namespace gonio {
namespace {

using Kind = RecordedDisk::Kind;
RecordedDisk* g_disk = nullptr;  // hooks can reach nothing but globals

// ---- SQLite's files ----

struct RecordedFile {
  sqlite3_file base;
  std::string* name;  ///< relative to the folder; nullptr: not recorded
  bool synced_once;
  bool is_log;
  sqlite3_file* real;
};

RecordedFile& recorded(sqlite3_file* file) { return *reinterpret_cast<RecordedFile*>(file); }
sqlite3_file* real(sqlite3_file* file) { return recorded(file).real; }

/// True when the operation may be done.
bool taken(sqlite3_file* file, Kind kind, std::int64_t at = 0, std::string bytes = {}) {
  const RecordedFile& own = recorded(file);
  if (g_disk == nullptr || own.name == nullptr) return true;
  return g_disk->take({kind, *own.name, at, std::move(bytes)});
}

int x_close(sqlite3_file* file) {
  const int result = real(file)->pMethods->xClose(real(file));
  delete recorded(file).name;
  recorded(file).name = nullptr;
  return result;
}
int x_read(sqlite3_file* file, void* to, int size, sqlite3_int64 at) {
  return real(file)->pMethods->xRead(real(file), to, size, at);
}
int x_write(sqlite3_file* file, const void* from, int size, sqlite3_int64 at) {
  const std::string bytes(static_cast<const char*>(from), static_cast<std::size_t>(size));
  if (!taken(file, Kind::write, at, bytes)) {
    return errno == ENOSPC ? SQLITE_FULL : SQLITE_IOERR_WRITE;
  }
  return real(file)->pMethods->xWrite(real(file), from, size, at);
}
int x_truncate(sqlite3_file* file, sqlite3_int64 size) {
  if (!taken(file, Kind::truncate, size)) return SQLITE_IOERR_TRUNCATE;
  return real(file)->pMethods->xTruncate(real(file), size);
}
int x_sync(sqlite3_file* file, int) {
  if (!taken(file, Kind::sync)) return SQLITE_IOERR_FSYNC;
  RecordedFile& own = recorded(file);
  if (own.is_log && !std::exchange(own.synced_once, true) && !taken(file, Kind::sync_folder)) {
    return SQLITE_IOERR_DIR_FSYNC;
  }
  return SQLITE_OK;  // the disk under the test is not to be trusted with anything
}
int x_file_size(sqlite3_file* file, sqlite3_int64* size) {
  return real(file)->pMethods->xFileSize(real(file), size);
}
int x_lock(sqlite3_file* file, int level) { return real(file)->pMethods->xLock(real(file), level); }
int x_unlock(sqlite3_file* file, int level) {
  return real(file)->pMethods->xUnlock(real(file), level);
}
int x_check_reserved(sqlite3_file* file, int* out) {
  return real(file)->pMethods->xCheckReservedLock(real(file), out);
}
int x_file_control(sqlite3_file* file, int what, void* argument) {
  return real(file)->pMethods->xFileControl(real(file), what, argument);
}
int x_sector_size(sqlite3_file* file) { return real(file)->pMethods->xSectorSize(real(file)); }
int x_characteristics(sqlite3_file* file) {
  return real(file)->pMethods->xDeviceCharacteristics(real(file));
}
int x_shm_map(sqlite3_file* file, int page, int size, int extend, void volatile** out) {
  return real(file)->pMethods->xShmMap(real(file), page, size, extend, out);
}
int x_shm_lock(sqlite3_file* file, int offset, int count, int flags) {
  return real(file)->pMethods->xShmLock(real(file), offset, count, flags);
}
void x_shm_barrier(sqlite3_file* file) { real(file)->pMethods->xShmBarrier(real(file)); }
int x_shm_unmap(sqlite3_file* file, int remove) {
  return real(file)->pMethods->xShmUnmap(real(file), remove);
}

const sqlite3_io_methods kMethods{2,
                                  x_close,
                                  x_read,
                                  x_write,
                                  x_truncate,
                                  x_sync,
                                  x_file_size,
                                  x_lock,
                                  x_unlock,
                                  x_check_reserved,
                                  x_file_control,
                                  x_sector_size,
                                  x_characteristics,
                                  x_shm_map,
                                  x_shm_lock,
                                  x_shm_barrier,
                                  x_shm_unmap,
                                  nullptr,
                                  nullptr};

sqlite3_vfs* g_real_vfs = nullptr;

int x_open(sqlite3_vfs*, const char* name, sqlite3_file* file, int flags, int* out_flags) {
  RecordedFile& own = recorded(file);
  own.base.pMethods = nullptr;
  own.name = nullptr;
  own.synced_once = false;
  own.real = reinterpret_cast<sqlite3_file*>(&own + 1);
  const std::string relative =
      g_disk != nullptr && name != nullptr ? g_disk->inside(name) : std::string();
  const bool is_new = !relative.empty() && ::access(name, F_OK) != 0;
  own.is_log = is_new && (flags & (SQLITE_OPEN_WAL | SQLITE_OPEN_MAIN_JOURNAL)) != 0;
  const int result = g_real_vfs->xOpen(g_real_vfs, name, own.real, flags, out_flags);
  if (own.real->pMethods == nullptr) return result;
  own.base.pMethods = &kMethods;
  if (!relative.empty()) own.name = new std::string(relative);
  if (result == SQLITE_OK && is_new && !taken(file, Kind::create)) return SQLITE_CANTOPEN;
  return result;
}

int x_delete(sqlite3_vfs*, const char* name, int sync_folder) {
  const std::string relative = g_disk != nullptr ? g_disk->inside(name) : std::string();
  if (!relative.empty() && ::access(name, F_OK) == 0) {
    if (!g_disk->take({Kind::remove, relative, 0, {}})) return SQLITE_IOERR_DELETE;
    if (sync_folder != 0 && !g_disk->take({Kind::sync_folder, relative, 0, {}})) {
      return SQLITE_IOERR_DIR_FSYNC;
    }
  }
  return g_real_vfs->xDelete(g_real_vfs, name, 0);
}

void install_under_sqlite() {
  static sqlite3_vfs vfs = [] {
    g_real_vfs = sqlite3_vfs_find(nullptr);
    sqlite3_vfs own = *g_real_vfs;
    own.szOsFile = static_cast<int>(sizeof(RecordedFile)) + g_real_vfs->szOsFile;
    own.zName = "recorded";
    own.pNext = nullptr;
    own.xOpen = x_open;
    own.xDelete = x_delete;
    return own;
  }();
  if (sqlite3_vfs_find("recorded") == nullptr) sqlite3_vfs_register(&vfs, 1);
}

std::string contents_of(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

// ---- what a disk holds ----

std::string folder_of(const std::string& path) {
  return std::filesystem::path(path).parent_path().string();
}

class Disk {
 public:
  void apply(const RecordedDisk::Operation& operation) {
    switch (operation.kind) {
      case Kind::create:
        if (!names_.contains(operation.path)) {
          names_[operation.path] = files_.size();
          files_.emplace_back();
        }
        break;
      case Kind::write:
      case Kind::truncate: {
        File& file = files_.at(names_.at(operation.path));
        change(file.now, operation);
        file.unsynced.push_back(operation);
        break;
      }
      case Kind::sync: {
        File& file = files_.at(names_.at(operation.path));
        file.durable = file.now;
        file.unsynced.clear();
        break;
      }
      case Kind::rename:
        names_[operation.bytes] = names_.at(operation.path);
        names_.erase(operation.path);
        break;
      case Kind::remove:
        names_.erase(operation.path);
        break;
      case Kind::sync_folder:
        sync_names(folder_of(operation.path));
        break;
    }
  }

  void cut_power(RecordedDisk::Loss loss, std::uint64_t seed) {
    std::mt19937_64 random(seed);
    const auto comes_through = [&] {
      return loss == RecordedDisk::Loss::at_random && random() % 2 == 0;
    };
    for (File& file : files_) {
      std::string kept = file.durable;
      for (const RecordedDisk::Operation& write : file.unsynced) {
        if (comes_through()) change(kept, write);
      }
      file.now = std::move(kept);
    }
    std::set<std::string> all;
    for (const auto& entry : names_) all.insert(entry.first);
    for (const auto& entry : durable_names_) all.insert(entry.first);
    std::map<std::string, std::size_t> kept;
    for (const std::string& name : all) {
      const auto& names = comes_through() ? names_ : durable_names_;
      const auto found = names.find(name);
      if (found != names.end()) kept[name] = found->second;
    }
    names_ = std::move(kept);
  }

  void write_to(const std::filesystem::path& folder) const {
    std::filesystem::create_directories(folder / "frames");
    for (const auto& [name, file] : names_) {
      std::ofstream(folder / name, std::ios::binary) << files_.at(file).now;
    }
  }

 private:
  struct File {
    std::string now;
    std::string durable;
    std::vector<RecordedDisk::Operation> unsynced;
  };

  static void change(std::string& bytes, const RecordedDisk::Operation& operation) {
    const auto at = static_cast<std::size_t>(operation.at);
    if (operation.kind == Kind::truncate) {
      bytes.resize(at);
      return;
    }
    if (bytes.size() < at + operation.bytes.size()) bytes.resize(at + operation.bytes.size());
    bytes.replace(at, operation.bytes.size(), operation.bytes);
  }

  void sync_names(const std::string& folder) {
    std::erase_if(durable_names_,
                  [&](const auto& entry) { return folder_of(entry.first) == folder; });
    for (const auto& entry : names_) {
      if (folder_of(entry.first) == folder) durable_names_.insert(entry);
    }
  }

  std::vector<File> files_;
  std::map<std::string, std::size_t> names_;
  std::map<std::string, std::size_t> durable_names_;
};

}  // namespace

RecordedDisk::RecordedDisk(std::filesystem::path folder) : folder_(std::move(folder)) {
  install_under_sqlite();
  if (std::filesystem::exists(folder_)) {
    for (const auto& entry : std::filesystem::recursive_directory_iterator(folder_)) {
      const std::string name = inside(entry.path().string());
      // SQLite's index of its log is memory, and made anew.
      if (!entry.is_regular_file() || name.ends_with("-shm")) continue;
      found_.push_back({Kind::create, name, 0, {}});
      found_.push_back({Kind::write, name, 0, contents_of(entry.path().string())});
      found_.push_back({Kind::sync, name, 0, {}});
      found_.push_back({Kind::sync_folder, name, 0, {}});
    }
  }
  g_disk = this;
}

RecordedDisk::~RecordedDisk() { g_disk = nullptr; }

void RecordedDisk::fail_from(std::size_t from, int error) {
  fails_from_ = from;
  error_ = error;
}

bool RecordedDisk::take(Operation operation) {
  if (operations_.size() >= fails_from_) {
    errno = error_;
    return false;
  }
  operations_.push_back(std::move(operation));
  return true;
}

std::string RecordedDisk::inside(const std::string& path) const {
  const std::string start = folder_.string() + "/";
  return path.starts_with(start) ? path.substr(start.size()) : std::string();
}

void RecordedDisk::restore(std::size_t count, Loss loss, std::uint64_t seed,
                           const std::filesystem::path& to) const {
  Disk disk;
  for (const Operation& each : found_) disk.apply(each);
  for (std::size_t i = 0; i < count; ++i) disk.apply(operations_.at(i));
  if (loss == Loss::half_write && count < operations_.size() &&
      operations_[count].kind == Kind::write) {
    Operation half = operations_[count];
    half.bytes.resize(half.bytes.size() / 2);
    disk.apply(half);
  }
  if (loss == Loss::unsynced || loss == Loss::at_random) disk.cut_power(loss, seed);
  disk.write_to(to);
}

}  // namespace gonio

// ---- the system calls of gonio::files ----

extern "C" {
int __real_renameat2(int from_folder, const char* from, int to_folder, const char* to,
                     unsigned int flags);

int __wrap_fsync(int descriptor) {
  using gonio::RecordedDisk;
  std::array<char, 4096> text{};
  const std::string link = "/proc/self/fd/" + std::to_string(descriptor);
  const ssize_t size = ::readlink(link.c_str(), text.data(), text.size());
  const std::string path(text.data(), size > 0 ? static_cast<std::size_t>(size) : 0);
  const std::string relative =
      gonio::g_disk != nullptr ? gonio::g_disk->inside(path) : std::string();
  if (relative.empty()) return 0;  // as for SQLite: no test here outlives its machine
  const auto take = [&](RecordedDisk::Kind kind, const std::string& name, std::string bytes) {
    return gonio::g_disk->take({kind, name, 0, std::move(bytes)});
  };
  struct stat status {};
  if (::fstat(descriptor, &status) == 0 && S_ISDIR(status.st_mode)) {
    return take(RecordedDisk::Kind::sync_folder, relative + "/any", {}) ? 0 : -1;
  }
  return take(RecordedDisk::Kind::create, relative, {}) &&
                 take(RecordedDisk::Kind::write, relative, gonio::contents_of(path)) &&
                 take(RecordedDisk::Kind::sync, relative, {})
             ? 0
             : -1;
}

int __wrap_renameat2(int from_folder, const char* from, int to_folder, const char* to,
                     unsigned int flags) {
  using gonio::RecordedDisk;
  const std::string relative =
      gonio::g_disk != nullptr ? gonio::g_disk->inside(from) : std::string();
  if (!relative.empty() &&
      !gonio::g_disk->take({RecordedDisk::Kind::rename, relative, 0, gonio::g_disk->inside(to)})) {
    return -1;
  }
  return __real_renameat2(from_folder, from, to_folder, to, flags);
}
}
