#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include "frame_sequence.h"
#include "gonio/aravis_camera/camera_link.h"
#include "gonio/aravis_camera/counters.h"
#include "gonio/aravis_camera/options.h"
#include "gonio/aravis_camera/wire_format.h"
#include "gonio/devices/frame.h"

namespace gonio::aravis_camera {

/// What came out of the stream, looked through and made a frame.
class FrameReader {
 public:
  /// All must outlive it; it counts what it refuses.
  FrameReader(const AravisCameraOptions& options, const CameraIdentity& identity,
              CameraCounters& counters);

  /// The next frame will be the first of a new acquisition.
  void restart() { sequence_.restart(); }
  /// A frame that nobody wants: it counts for the order of those after it.
  void pass_over(const RawFrame& raw);
  /// Why a buffer is not a frame. Empty when it is one, as far as can be told without its pixels.
  std::string problem_of(const RawFrame& raw);
  /// All but number and start. Throws DeviceError, Protocol, when its pixels are no numbers of the
  /// format.
  void fill(devices::Frame& frame, const RawFrame& raw, const CameraState& state);

  const WireFormat& format() const { return format_; }
  std::uint16_t saturation_level() const;

 private:
  std::size_t pixels() const;
  double gain_db(const CameraState& state) const;
  void require_format_bits(std::uint64_t id, std::span<const std::uint16_t> pixels_dn);

  const AravisCameraOptions& options_;
  const CameraIdentity& identity_;
  CameraCounters& counters_;
  const WireFormat& format_;
  FrameSequence sequence_;
};

}  // namespace gonio::aravis_camera
