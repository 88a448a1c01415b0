#pragma once

#include <chrono>
#include <vector>

#include "gonio/acquisition/session_archive.h"

namespace gonio::acquisition {

/// The parts of a session, one process each. Darks and whites of a part belong to its points; a
/// point measured again belongs to the part that acknowledged it last.
class SessionParts {
 public:
  explicit SessionParts(const SessionReader& archive);

  std::size_t count() const { return starts_.size() + 1; }
  /// The part a time of the session clock lies in, from 0. The clock never goes back.
  std::size_t at(std::chrono::nanoseconds time) const;
  std::size_t of(const FrameRecord& frame) const { return at(frame.exposure_start); }
  std::size_t of(const PointRecord& point) const { return at(point.finished_at); }

 private:
  std::vector<std::chrono::nanoseconds> starts_;  ///< of the second part, the third, ...
};

}  // namespace gonio::acquisition
