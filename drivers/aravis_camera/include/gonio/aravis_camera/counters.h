#pragma once

#include <cstdint>
#include <string>

namespace gonio::aravis_camera {

/// What has happened to frames since the camera was constructed.
struct CameraCounters {
  std::uint64_t frames = 0;      ///< good ones
  std::uint64_t retried = 0;     ///< exposures repeated within a capture()
  std::uint64_t timeouts = 0;    ///< triggers without a frame in time
  std::uint64_t incomplete = 0;  ///< frames with packets missing, or of a wrong size
  /// Frames that no capture() asked for: begun before the call, thrown away.
  std::uint64_t unexpected = 0;
  std::uint64_t out_of_order = 0;     ///< frames whose id or time stamp did not go on
  std::uint64_t id_gaps = 0;          ///< frames missing between two that came
  std::uint64_t timestamp_jumps = 0;  ///< the camera's clock and the host's went differently
  std::uint64_t wrong_settings = 0;   ///< frames taken under other settings than asked for
  std::uint64_t reconnects = 0;
};

/// One line for a session's notes: "frames 120, retried 1, incomplete 1". Frames always, the others
/// where they are not 0.
std::string to_text(const CameraCounters& counters);

}  // namespace gonio::aravis_camera
