#pragma once

#include <chrono>
#include <functional>

#include "gonio/devices/frame.h"

namespace gonio::devices {

/// A camera that leaves its caller the time of an exposure, an extra ability: to look at other
/// devices while the light is gathered.
///
/// Threads  As Camera.
/// Errors   As Camera.
class WatchableCamera {
 public:
  virtual ~WatchableCamera() = default;
  WatchableCamera(const WatchableCamera&) = delete;
  WatchableCamera& operator=(const WatchableCamera&) = delete;

  /// As Camera::capture(). `meanwhile` is called on the same thread once the exposure has begun,
  /// and once more for every repetition of it; the frame is waited for when it returns. It must not
  /// throw, nor use the camera.
  virtual Frame capture(std::chrono::nanoseconds exposure,
                        const std::function<void()>& meanwhile) = 0;

 protected:
  WatchableCamera() = default;
};

}  // namespace gonio::devices
