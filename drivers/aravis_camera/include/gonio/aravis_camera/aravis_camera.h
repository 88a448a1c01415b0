#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <stop_token>
#include <string>
#include <vector>

#include "gonio/aravis_camera/camera_link.h"
#include "gonio/aravis_camera/counters.h"
#include "gonio/aravis_camera/options.h"
#include "gonio/devices/camera.h"
#include "gonio/devices/steady_clock.h"
#include "gonio/devices/temperature_sensor.h"
#include "gonio/devices/watchable_camera.h"

namespace gonio::aravis_camera {

/// A GigE Vision or USB3 Vision camera.
///
/// Settings  Set and read back when it is opened; exposure, gain, black level, pixel format, region
///           and every automatic feature are read back again after each frame. A frame under other
///           settings is a Protocol error, after `retries` exposures with all of it set again.
/// Frames    By trigger. `exposure` is what the camera says it applied; `exposure_start` is taken
///           just before a software trigger is sent; with a hardware trigger it is the arrival less
///           exposure and readout.
/// Age       What was exposed before the call is never returned. A frame that arrives sooner after
/// a
///           software trigger than its exposure lasts is a Protocol error. With a hardware trigger
///           every capture() starts the acquisition anew, lets what a longer exposure before it may
///           still bring run out, and passes over frames that arrive sooner after the call than
///           exposure and readout. So the pulses have to go on until one counts.
/// Pixels    A number above the largest of the pixel format is a Protocol error: bytes of another
///           order or alignment than the format's.
/// Errors    As Camera. Timeout: no frame came. Protocol: it came incomplete, out of order or under
///           other settings. Disconnected: the control channel is silent or another program has
///           taken it; the next capture() connects anew, for at most open_patience, and refuses
///           another serial number. A connection that died may take 5 s to let go of.
///           LimitViolation: a setting that the camera does not take. Fault: it lacks a feature.
/// Threads   One controlling thread; Aravis receives in one of its own and never holds more than a
///           fixed number of buffers.
class AravisCamera final : public devices::Camera,
                           public devices::TemperatureSensor,
                           public devices::WatchableCamera {
 public:
  /// Connected and verified once constructed. The clock must outlive it; its scale is that of an
  /// emulated camera's time against the host's. After `stop` no attempt to connect begins, now or
  /// later; one under way takes 2.5 s at most where nobody answers. Throws std::invalid_argument as
  /// validate() does, DeviceError; Stopped after `stop`.
  AravisCamera(const AravisCameraOptions& options, const devices::SteadyClock& clock,
               std::stop_token stop = {});
  /// Over another link than Aravis'.
  AravisCamera(const AravisCameraOptions& options, const devices::SteadyClock& clock,
               LinkOpener opener, std::stop_token stop = {});
  ~AravisCamera() override;

  const std::string& name() const override;
  devices::CameraInfo info() const override;
  devices::Frame capture(std::chrono::nanoseconds exposure) override;
  /// With a hardware trigger `meanwhile` begins when a pulse may come.
  devices::Frame capture(std::chrono::nanoseconds exposure,
                         const std::function<void()>& meanwhile) override;
  double temperature_c() override;

  /// Lets the camera run without triggers and hands on every frame until `take` returns false; the
  /// settings are read back before and after. For a live picture: frames may be missing or bad and
  /// are then left out (counters); twenty bad ones in a row are a Protocol error.
  void stream(std::chrono::nanoseconds exposure,
              const std::function<bool(const devices::Frame&)>& take);

  const CameraIdentity& identity() const;
  /// Of all connections so far; to_text() makes them a session's note.
  CameraCounters counters() const;

 private:
  class Machine;
  std::unique_ptr<Machine> machine_;
};

/// A camera that answered a search.
struct CameraDeviceInfo {
  std::string id;  ///< for AravisCameraOptions::device
  std::string vendor;
  std::string model;
  std::string serial;
  std::string address;   ///< IPv4, or the place on the USB
  std::string protocol;  ///< "GigEVision" or "USB3Vision"
};

/// Searches on all interfaces: broadcasts, and takes about a second.
std::vector<CameraDeviceInfo> list_cameras();

/// What the first constructor of AravisCamera uses.
LinkOpener aravis_opener(const AravisCameraOptions& options);

}  // namespace gonio::aravis_camera
