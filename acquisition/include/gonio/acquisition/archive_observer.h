#pragma once

#include "gonio/acquisition/session_archive.h"

namespace gonio::acquisition {

/// Told of what a session's archive has acknowledged, as soon as it has: for who shows a running
/// session. All times are the session's.
///
/// Threads  Called on the session's thread, which waits meanwhile: look, keep a copy, return.
/// Errors   None get out: who only looks on must not end a session.
class ArchiveObserver {
 public:
  virtual ~ArchiveObserver() = default;
  ArchiveObserver(const ArchiveObserver&) = delete;
  ArchiveObserver& operator=(const ArchiveObserver&) = delete;

  virtual void on_frame(const FrameRecord& record, const devices::Frame& frame) noexcept = 0;
  virtual void on_point(const PointRecord& record) noexcept = 0;
  virtual void on_note(const SessionNote& note) noexcept = 0;

 protected:
  ArchiveObserver() = default;
};

}  // namespace gonio::acquisition
