#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>

namespace gonio::aravis_camera {

/// Follows ids and time stamps of the frames of one acquisition.
class FrameSequence {
 public:
  struct Verdict {
    std::string problem;        ///< why the frame must not be used; empty: it may
    std::uint64_t missing = 0;  ///< frames that should have been between this one and the last
    bool jump = false;  ///< the camera's clock and the host's went differently since the last
  };

  /// The next frame, that arrived at `host`. Ids count by one and are 16 bits wide, where 65535 is
  /// followed by 1 (GigE Vision 1.x) or 0, or 64 bits wide.
  Verdict next(std::uint64_t id, std::uint64_t timestamp_ns, std::chrono::nanoseconds host);

  /// A new acquisition counts anew.
  void restart() { last_.reset(); }

 private:
  struct Seen {
    std::uint64_t id;
    std::uint64_t timestamp_ns;
    std::chrono::nanoseconds host;
  };
  std::optional<Seen> last_;
};

}  // namespace gonio::aravis_camera
