#include "gonio/acquisition/disk.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <system_error>

#include "gonio/acquisition/session_archive.h"
#include "gonio/errors/errors.h"
#include "gonio/files/process_lock.h"

namespace gonio::acquisition {
namespace {

/// Of a frame's file beside its pixels, and its row in the journal with its index and checksum;
/// files end at blocks of 4 KiB.
constexpr std::uint64_t kBytesPerFrame = 8192;
/// Configuration, notes, points, and the write-ahead log at its largest.
constexpr std::uint64_t kBytesPerSession = 16U << 20U;

/// What is needed upwards, what there is downwards: then the figures say what is too little.
std::string size_text(std::uint64_t bytes, double (*rounded)(double)) {
  const auto size = static_cast<double>(bytes);
  constexpr double kTenth = 1e5;
  constexpr double kGiga = 1e9;
  return size < kGiga ? fmt::format("{:.1f} MB", rounded(size / kTenth) / 10.0)
                      : fmt::format("{:.1f} GB", rounded(10.0 * size / kGiga) / 10.0);
}

}  // namespace

std::uint64_t archive_bytes(const devices::CameraInfo& camera, int frames) {
  const std::uint64_t pixels =
      static_cast<std::uint64_t>(camera.width_px) * static_cast<std::uint64_t>(camera.height_px);
  return static_cast<std::uint64_t>(std::max(frames, 0)) *
             (pixels * sizeof(std::uint16_t) + kBytesPerFrame) +
         kBytesPerSession;
}

DiskUse disk_use(const devices::CameraInfo& camera, int frames, int frames_high,
                 const std::filesystem::path& folder) {
  std::error_code error;
  std::filesystem::path place = std::filesystem::absolute(folder, error);
  while (!error && !std::filesystem::exists(place) && place.has_parent_path() &&
         place != place.parent_path()) {
    place = place.parent_path();
  }
  const std::filesystem::space_info space = std::filesystem::space(place, error);
  if (error) throw FileError(place, "look at the free space of", error.message());
  return {archive_bytes(camera, frames), archive_bytes(camera, frames_high), space.available};
}

Check check_disk(const DiskUse& use, const std::filesystem::path& folder) {
  const std::string figures = fmt::format(
      "{} needed, {} at most, {} free", size_text(use.needed_bytes, std::ceil),
      size_text(use.needed_high_bytes, std::ceil), size_text(use.free_bytes, std::floor));
  if (use.free_bytes < use.needed_bytes) {
    return {"disk", CheckResult::refuse,
            fmt::format("{}: too little disk: {}; make room or choose another folder",
                        folder.string(), figures)};
  }
  const bool may_fill = use.free_bytes < use.needed_high_bytes;
  return {"disk", may_fill ? CheckResult::note : CheckResult::pass,
          figures + (may_fill ? ": a dim sample may fill it" : "")};
}

DiskReserve::DiskReserve(const std::filesystem::path& session, std::uint64_t bytes)
    : path_(disk_reserve_file(session)) {
  // Some file systems take all that is left before they say that it was not enough.
  std::error_code error;
  const std::filesystem::space_info space = std::filesystem::space(session, error);
  if (!error && space.available < bytes) throw FileError(path_, "set space aside", ENOSPC);
  constexpr int kOwnerOnly = 0600;
  file_ = ::open(path_.c_str(), O_CREAT | O_EXCL | O_WRONLY | O_CLOEXEC | O_NOFOLLOW, kOwnerOnly);
  if (file_ < 0) throw FileError(path_, "create", errno);
  int result = 0;
  do {
    result = ::fallocate(file_, 0, 0, static_cast<off_t>(bytes));
  } while (result != 0 && errno == EINTR);
  if (result == 0) {
    held_bytes_ = bytes;
    return;
  }
  const int saved_errno = errno;
  // A limit on the size of files says nothing about the disk.
  if (saved_errno == EOPNOTSUPP || saved_errno == ENOSYS || saved_errno == EFBIG) return;
  ::close(file_);
  ::unlink(path_.c_str());
  throw FileError(path_, "set space aside", saved_errno);
}

DiskReserve::~DiskReserve() {
  // In a folder that was moved it has another name, and this one may be another session's.
  const bool still_ours = files::names_open_file(path_, file_);
  ::close(file_);
  if (still_ours) ::unlink(path_.c_str());
}

void DiskReserve::keep(std::uint64_t bytes) noexcept {
  if (bytes >= held_bytes_) return;
  if (::ftruncate(file_, static_cast<off_t>(bytes)) == 0) held_bytes_ = bytes;
}

}  // namespace gonio::acquisition
