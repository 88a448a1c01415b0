#pragma once

#include <chrono>
#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include "gonio/devices/camera.h"
#include "gonio/devices/clock.h"
#include "gonio/emulator_faults/fault_plan.h"

/// A GigE Vision camera on loopback that shows a simulated world.
namespace gonio::gige_emulator {

/// Who the camera is and where it answers.
struct GigeCameraOptions {
  std::string name = "camera";  ///< in the fault plan
  /// IPv4 address of an interface of this machine; the port of GigE Vision is fixed (3956), so one
  /// camera has one address to itself.
  std::string address = "127.0.0.1";
  std::string vendor = "Gonio";
  std::string model;   ///< empty: the world camera's
  std::string serial;  ///< empty: the world camera's; below 16 characters
  int adc_bits = 12;   ///< of the world camera's DN; formats with more or fewer bits are shifted
  double black_level_dn = 64.0;  ///< what BlackLevel is until it is set; of the converter
  double temperature_c = 38.5;
};

/// A time on the host's steady clock, for an account of what the wall time was spent on.
using HostTime = std::chrono::steady_clock::time_point;

struct ExposureRecord {
  HostTime start;
  HostTime end;  ///< of exposure, readout and rendering
};

struct TransferRecord {
  HostTime start;
  std::size_t bytes = 0;  ///< of pixels; how long a link would take is the reader's arithmetic
};

/// What the camera has done so far.
struct GigeCameraLog {
  std::vector<ExposureRecord> exposures;
  std::vector<TransferRecord> transfers;
  std::size_t dropped_triggers = 0;  ///< came while exposing, or the acquisition ended meanwhile
};

/// Features of the camera that a test may change behind its master's back.
enum class Feature {
  exposure_auto,
  gain_auto,
  black_level_auto,
  gamma_enable,
  pixel_format,  ///< value: PFNC code
  width,
  exposure_time_us,
  temperature_c,
  payload_bytes  ///< what it says that a frame takes; 0: the truth
};

/// The camera: control channel and stream of Aravis' fake camera with a GenICam description of our
/// own, behind it a thread that exposes.
///
/// Features  ExposureTime (us), Gain (dB), BlackLevel (DN of the converter), PixelFormat (Mono or
///           Bayer as the world's camera: 8, 10, 12, 16 bit and packed), Width, Height, OffsetX,
///           OffsetY, TriggerMode, TriggerSource (Software, Line1), TriggerSoftware,
///           DeviceTemperature, and the automatic ones, all off.
/// Trigger   The thread sees it within a millisecond, calls capture() of the world's camera, packs
///           the frame and only then lets the fake camera send it: the control channel answers
///           during an exposure however long. A trigger while exposing is dropped, and so is an
///           exposure during which the acquisition was stopped.
/// Faults    At every trigger: no_frame, wrong_exposure, lost_packets, duplicate_frame_id, and
///           dead_link: the camera vanishes with everything it was set to; while it is away it asks
///           again every 100 ms and comes back when the fault has worn off.
/// Threads   One thread may use the object; the world's camera belongs to the camera's own thread.
/// Source    GigE Vision 2.0 and SFNC 2.4 as far as Aravis 0.8.26 has them.
class GigeCamera {
 public:
  /// Answers once constructed. The world's camera, clock and faults must outlive it. Throws
  /// std::invalid_argument for an identity that does not fit, std::runtime_error when the address
  /// cannot be used: no interface has it, or a camera is there already.
  GigeCamera(const GigeCameraOptions& options, devices::Camera& world, devices::Clock& clock,
             emulator_faults::FaultPlan& faults);
  ~GigeCamera();
  GigeCamera(const GigeCamera&) = delete;
  GigeCamera& operator=(const GigeCamera&) = delete;

  const std::string& address() const;

  /// Takes the camera off the network as a cut of its power does.
  void unplug();
  /// Back with everything at its default. Throws std::runtime_error as the constructor.
  void plug_in();

  void set(Feature feature, double value);

  /// A pulse on Line1: exposes when that is the trigger's source.
  void pulse();

  /// What it shows while TriggerMode is Off: these frames round and round, as fast as the stream
  /// goes or `frames_per_second`. Full sensor, DN of the world's camera.
  void show_when_free_running(std::vector<devices::Frame> frames, double frames_per_second);

  GigeCameraLog log() const;

 private:
  class Body;
  std::unique_ptr<Body> body_;
};

}  // namespace gonio::gige_emulator
