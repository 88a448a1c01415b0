#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "gonio/aravis_camera/camera_link.h"
#include "gonio/aravis_camera/options.h"
#include "gonio/devices/camera.h"
#include "gonio/devices/steady_clock.h"
#include "gonio/devices/temperature_sensor.h"

namespace gonio::aravis_camera {

/// What has happened to frames since the camera was constructed.
struct CameraCounters {
  std::uint64_t frames = 0;           ///< good ones
  std::uint64_t retried = 0;          ///< exposures repeated within a capture()
  std::uint64_t timeouts = 0;         ///< triggers without a frame in time
  std::uint64_t incomplete = 0;       ///< frames with packets missing, or of a wrong size
  std::uint64_t unexpected = 0;       ///< frames nobody asked for, thrown away before a trigger
  std::uint64_t out_of_order = 0;     ///< frames whose id or time stamp did not go on
  std::uint64_t id_gaps = 0;          ///< frames missing between two that came
  std::uint64_t timestamp_jumps = 0;  ///< the camera's clock and the host's went differently
  std::uint64_t wrong_settings = 0;   ///< frames taken under other settings than asked for
  std::uint64_t reconnects = 0;
};

/// A GigE Vision or USB3 Vision camera.
///
/// Settings  Set and read back when it is opened; exposure, gain, black level, pixel format, region
///           and every automatic feature are read back again after each frame. A frame under other
///           settings is a Protocol error, after `retries` exposures with all of it set again.
/// Frames    By trigger. `exposure` is what the camera says it applied; `exposure_start` is taken
///           just before a software trigger is sent; with a hardware trigger it is the arrival less
///           exposure and readout. What was exposed before the call is never returned.
/// Errors    As Camera. Timeout: no frame came. Protocol: it came incomplete, out of order or under
///           other settings. Disconnected: the control channel is silent or another program has
///           taken it; the next capture() connects anew, for at most open_patience, and refuses
///           another serial number. A connection that died may take 5 s to let go of.
///           LimitViolation: a setting that the camera does not take. Fault: it lacks a feature.
/// Threads   One controlling thread; Aravis receives in one of its own and never holds more than a
///           fixed number of buffers.
class AravisCamera final : public devices::Camera, public devices::TemperatureSensor {
 public:
  /// Connected and verified once constructed. The clock must outlive it; its scale is that of an
  /// emulated camera's time against the host's. Throws std::invalid_argument as validate() does,
  /// DeviceError.
  AravisCamera(const AravisCameraOptions& options, const devices::SteadyClock& clock);
  /// Over another link than Aravis'.
  AravisCamera(const AravisCameraOptions& options, const devices::SteadyClock& clock,
               LinkOpener opener);
  ~AravisCamera() override;

  const std::string& name() const override;
  devices::CameraInfo info() const override;
  devices::Frame capture(std::chrono::nanoseconds exposure) override;
  double temperature_c() override;

  /// Lets the camera run without triggers and hands on every frame until `take` returns false; the
  /// settings are read back before and after. For a live picture: frames may be missing or bad and
  /// are then left out (counters); twenty bad ones in a row are a Protocol error.
  void stream(std::chrono::nanoseconds exposure,
              const std::function<bool(const devices::Frame&)>& take);

  const CameraIdentity& identity() const;
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
