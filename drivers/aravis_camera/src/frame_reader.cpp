#include "frame_reader.h"

#include <chrono>
#include <cmath>

#include "gonio/aravis_camera/unpack.h"
#include "gonio/devices/device_error.h"
#include "text.h"

namespace gonio::aravis_camera {

using devices::DeviceErrc;
using devices::DeviceError;

FrameReader::FrameReader(const AravisCameraOptions& options, const CameraIdentity& identity,
                         CameraCounters& counters)
    : options_(options),
      identity_(identity),
      counters_(counters),
      format_(*find_wire_format(options.pixel_format)) {}

void FrameReader::pass_over(const RawFrame& raw) {
  ++counters_.unexpected;
  sequence_.next(raw.id, raw.timestamp_ns, raw.arrived);
}

std::string FrameReader::problem_of(const RawFrame& raw) {
  const FrameSequence::Verdict verdict = sequence_.next(raw.id, raw.timestamp_ns, raw.arrived);
  counters_.id_gaps += verdict.missing;
  counters_.timestamp_jumps += verdict.jump ? 1 : 0;
  if (!raw.complete) {
    ++counters_.incomplete;
    return joined("frame ", raw.id, " is incomplete: ", raw.problem,
                  "; see network tuning in docs/hardware.md");
  }
  if (!verdict.problem.empty()) {
    ++counters_.out_of_order;
    return joined("frame ", verdict.problem);
  }
  if (raw.pixel_format != format_.code) {
    ++counters_.wrong_settings;
    return joined("frame ", raw.id, " has pixel format ", format_text(raw.pixel_format), ", asked ",
                  format_.name);
  }
  if (raw.width != identity_.region.width || raw.height != identity_.region.height) {
    ++counters_.wrong_settings;
    return joined("frame ", raw.id, " has ", raw.width, " x ", raw.height, " px, asked ",
                  as_text(identity_.region));
  }
  const std::size_t expected = packed_size(format_.packing, pixels());
  if (raw.bytes.size() != expected) {
    ++counters_.incomplete;
    return joined("frame ", raw.id, " has ", raw.bytes.size(), " bytes, expected ", expected);
  }
  return {};
}

std::size_t FrameReader::pixels() const {
  return static_cast<std::size_t>(identity_.region.width) *
         static_cast<std::size_t>(identity_.region.height);
}

void FrameReader::fill(devices::Frame& frame, const RawFrame& raw, const CameraState& state) {
  frame.width_px = identity_.region.width;
  frame.height_px = identity_.region.height;
  frame.pixel_format = format_.layout;
  frame.saturation_level_dn = saturation_level();
  frame.black_level_dn = identity_.black_level_feature.empty()
                             ? options_.black_level_dn
                             : state.black_level * options_.black_level_unit_dn;
  frame.gain_db = gain_db(state);
  frame.exposure = std::chrono::nanoseconds(std::llround(state.exposure_us * 1000.0));
  frame.pixels_dn.resize(pixels());
  unpack(format_.packing, raw.bytes, frame.pixels_dn);
  if (format_.packing == Packing::word) require_format_bits(raw.id, frame.pixels_dn);
}

void FrameReader::require_format_bits(std::uint64_t id, std::span<const std::uint16_t> pixels_dn) {
  const unsigned above =
      static_cast<unsigned>(bits_in_use(pixels_dn)) >> static_cast<unsigned>(format_.bits);
  if (above == 0) return;
  ++counters_.wrong_settings;
  throw DeviceError(
      DeviceErrc::Protocol, options_.name,
      joined("frame ", id, " has numbers above the ", format_.bits, " bits of ", format_.name,
             ": left-aligned or big-endian pixels? Use its packed "
             "format or one of 8 or 16 bits"));
}

double FrameReader::gain_db(const CameraState& state) const {
  if (identity_.gain_feature.empty()) return 0.0;
  if (identity_.gain_feature != "GainRaw") return state.gain;
  return options_.gain_raw_per_db > 0.0 ? state.gain / options_.gain_raw_per_db : 0.0;
}

std::uint16_t FrameReader::saturation_level() const {
  return options_.saturation_level_dn != 0
             ? options_.saturation_level_dn
             : static_cast<std::uint16_t>((1U << static_cast<unsigned>(format_.bits)) - 1U);
}

}  // namespace gonio::aravis_camera
