#pragma once

#include <chrono>
#include <cstdint>
#include <string>

namespace gonio::aravis_camera {

/// A window of the sensor in pixels from its top left; a width of 0: the whole sensor.
struct Region {
  int x = 0;
  int y = 0;
  int width = 0;
  int height = 0;
};

/// What a camera is set to, as a rig file says it.
struct AravisCameraOptions {
  std::string name = "camera";

  /// IPv4 address of a GigE Vision camera (opened without any search), or an Aravis id as
  /// list_cameras() gives it (searched on all interfaces, which takes a second).
  std::string device;
  std::string serial;  ///< refused unless the camera has it; empty: any, but the same for ever

  std::string pixel_format = "Mono12";  ///< a name of wire_formats()
  Region region;
  double gain_db = 0.0;
  /// For cameras that have only GainRaw: its units per dB (manual of the camera); 0: not known.
  double gain_raw_per_db = 0.0;
  /// DN of the pixel format. What one unit of the camera's own feature means differs between
  /// cameras and sometimes between formats (manual of the camera, then a dark frame).
  double black_level_dn = 0.0;
  double black_level_unit_dn = 1.0;
  std::uint16_t saturation_level_dn = 0;  ///< 0: the largest number of the pixel format

  std::string trigger_line;  ///< hardware trigger, for example "Line1"; empty: by software
  int packet_size = 0;       ///< of GigE Vision, bytes with headers; 0: the largest that passes

  /// Session's time from the end of an exposure to its frame. With a hardware trigger not more than
  /// the camera takes: a frame that comes sooner counts as one of a pulse before the call.
  std::chrono::nanoseconds readout = std::chrono::milliseconds(10);
  /// Host's time that a frame may take on top of exposure and readout.
  std::chrono::milliseconds frame_margin{1500};
  int retries = 2;  ///< of one capture(), for frames that are missing or bad
  /// Host's time for which opening is tried again: a camera whose owner died is free after its
  /// heartbeat has run out, about 3 s.
  std::chrono::milliseconds open_patience{10000};

  /// Throws std::invalid_argument naming the field, what was found and what is expected.
  void validate() const;
};

}  // namespace gonio::aravis_camera
