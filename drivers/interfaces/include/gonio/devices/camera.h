#pragma once

#include <chrono>
#include <string>

#include "gonio/devices/device_error.h"
#include "gonio/devices/frame.h"

namespace gonio::devices {

/// What a camera can do and who it is; constant while connected.
struct CameraInfo {
  std::string model;
  std::string serial;
  int width_px = 0;
  int height_px = 0;
  PixelFormat pixel_format = PixelFormat::mono;
  std::uint16_t saturation_level_dn = 0;
  std::chrono::nanoseconds min_exposure{0};
  std::chrono::nanoseconds max_exposure{0};
  std::chrono::nanoseconds readout{0};  ///< dead time after an exposure, for duration estimates
};

/// A machine-vision camera with a linear response and every automatic feature off.
///
/// State    Ready once constructed. Gain and black level are set by the driver's configuration and
///          constant for its life; each frame carries them.
/// Threads  One controlling thread.
/// Errors   DeviceError: Timeout, Disconnected, Protocol (an incomplete or foreign frame),
///          LimitViolation (exposure outside the range: nothing is exposed), Fault.
class Camera {
 public:
  virtual ~Camera() = default;
  Camera(const Camera&) = delete;
  Camera& operator=(const Camera&) = delete;

  virtual const std::string& name() const = 0;
  virtual CameraInfo info() const = 0;

  /// Exposes once and returns the frame of exactly that exposure, never an older one.
  virtual Frame capture(std::chrono::nanoseconds exposure) = 0;

 protected:
  Camera() = default;
};

}  // namespace gonio::devices
