#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "gonio/aravis_camera/options.h"

/// What the camera's state machine needs of the library below it: the seam at which tests put
/// frames that no camera of good health sends.
namespace gonio::aravis_camera {

/// Who answers, and what does not change while it does.
struct CameraIdentity {
  std::string vendor;
  std::string model;
  std::string serial;
  Region region;  ///< as set
  double min_exposure_us = 0.0;
  double max_exposure_us = 0.0;
  int packet_size = 0;  ///< of GigE Vision, bytes with headers, as negotiated or asked; else 0
  /// Names under which this camera has the features, for example "ExposureTimeAbs"; "" when it has
  /// none.
  std::string exposure_feature;
  std::string gain_feature;
  std::string black_level_feature;
  std::string temperature_feature;
};

/// What the camera says that it is set to, read back now.
struct CameraState {
  double exposure_us = 0.0;
  double gain = 0.0;         ///< unit of its feature; 0 without one
  double black_level = 0.0;  ///< unit of its feature; 0 without one
  std::uint32_t pixel_format = 0;
  Region region;
  bool triggered = false;  ///< TriggerMode is On
  std::string trigger_source;
  std::vector<std::string>
      automatic;  ///< features that change the picture by themselves and are on
};

/// A buffer that came out of the stream. Valid within the call it is given to.
struct RawFrame {
  bool complete = false;
  std::string problem;  ///< of an incomplete one, for example "packets are missing"
  std::uint64_t id = 0;
  std::uint64_t timestamp_ns = 0;  ///< the camera's clock; 0: it has none
  /// When its last packet had come, by the host's steady clock since its epoch.
  std::chrono::nanoseconds arrived{0};
  std::uint32_t pixel_format = 0;
  int width = 0;
  int height = 0;
  std::span<const std::byte> bytes;
};

/// One connection to one camera, set up as the options say, its acquisition running.
///
/// Threads  One.
/// Errors   DeviceError; Disconnected means that the connection is of no more use.
class CameraLink {
 public:
  virtual ~CameraLink() = default;
  CameraLink(const CameraLink&) = delete;
  CameraLink& operator=(const CameraLink&) = delete;

  virtual const CameraIdentity& identity() const = 0;
  virtual CameraState state() = 0;

  virtual void set_exposure_us(double exposure_us) = 0;
  /// Software trigger: one exposure.
  virtual void trigger() = 0;

  using Take = std::function<void(const RawFrame&)>;
  /// Hands the oldest buffer that has come, waiting at most `patience` (host's time) for one.
  /// Returns false when none came.
  virtual bool take_frame(std::chrono::nanoseconds patience, const Take& take) = 0;

  /// Stops the acquisition, throws everything on the way away, sets all up again and starts anew:
  /// what was triggered before never comes. `free_running`: without triggers, as fast as it goes.
  virtual void restart(bool free_running) = 0;

  /// None when the camera has no such feature.
  virtual std::optional<double> temperature_c() = 0;

 protected:
  CameraLink() = default;
};

/// Opens a connection, or throws DeviceError after one attempt.
using LinkOpener = std::function<std::unique_ptr<CameraLink>()>;

}  // namespace gonio::aravis_camera
