#pragma once

#include <cstdint>
#include <filesystem>

#include "gonio/acquisition/preflight.h"
#include "gonio/devices/camera.h"

namespace gonio::acquisition {

/// Bytes that `frames` frames of this camera take in an archive, rows of the journal included.
std::uint64_t archive_bytes(const devices::CameraInfo& camera, int frames);

/// What a session needs of the disk and what is free where its folder will be.
struct DiskUse {
  std::uint64_t needed_bytes = 0;       ///< as expected
  std::uint64_t needed_high_bytes = 0;  ///< at the upper end of the forecast's interval
  std::uint64_t free_bytes = 0;         ///< for this user
};

/// `folder` need not exist yet; the nearest folder above it that does is looked at. Throws
/// FileError.
DiskUse disk_use(const devices::CameraInfo& camera, int frames, int frames_high,
                 const std::filesystem::path& folder);

/// The check named "disk": refused when less is free than expected, a note when only the upper end
/// of the interval does not fit.
Check check_disk(const DiskUse& use, const std::filesystem::path& folder);

/// Space of a session's disk that is set aside for frames it has still to write: others find the
/// disk full before the session does. A hidden file in the session's folder of frames, which
/// SessionWriter::resume() removes after a kill.
///
/// State    Holds until keep() gives some back; the destructor gives back all.
/// Threads  One.
class DiskReserve {
 public:
  /// Holds nothing where the file system, or a limit on the size of files, does not let it
  /// (held_bytes() says so). Throws
  /// FileError when there is not so much.
  DiskReserve(const std::filesystem::path& session, std::uint64_t bytes);
  ~DiskReserve();
  DiskReserve(const DiskReserve&) = delete;
  DiskReserve& operator=(const DiskReserve&) = delete;

  std::uint64_t held_bytes() const { return held_bytes_; }
  /// Gives back what is more than `bytes`. Never fails: what cannot be given back stays until the
  /// end.
  void keep(std::uint64_t bytes) noexcept;

 private:
  std::filesystem::path path_;
  int file_ = -1;
  std::uint64_t held_bytes_ = 0;
};

}  // namespace gonio::acquisition
