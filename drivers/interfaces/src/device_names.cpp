#include "gonio/devices/device_error.h"
#include "gonio/devices/frame.h"
#include "gonio/devices/target_changer.h"

namespace gonio::devices {

std::string_view to_string(DeviceErrc code) {
  switch (code) {
    case DeviceErrc::Timeout:
      return "timeout";
    case DeviceErrc::Disconnected:
      return "disconnected";
    case DeviceErrc::Protocol:
      return "protocol error";
    case DeviceErrc::NotHomed:
      return "not homed";
    case DeviceErrc::LimitViolation:
      return "limit violation";
    case DeviceErrc::Stopped:
      return "stopped";
    case DeviceErrc::Fault:
      return "fault";
  }
  return "unknown";
}

DeviceError::DeviceError(DeviceErrc code, std::string device, const std::string& message)
    : std::runtime_error(device + ": " + std::string(to_string(code)) + ": " + message),
      code_(code),
      device_(std::move(device)) {}

std::string_view to_string(PixelFormat format) {
  switch (format) {
    case PixelFormat::mono:
      return "mono";
    case PixelFormat::bayer_rggb:
      return "bayer_rggb";
    case PixelFormat::bayer_grbg:
      return "bayer_grbg";
    case PixelFormat::bayer_gbrg:
      return "bayer_gbrg";
    case PixelFormat::bayer_bggr:
      return "bayer_bggr";
  }
  return "unknown";
}

std::string_view to_string(Target target) {
  switch (target) {
    case Target::sample:
      return "sample";
    case Target::white:
      return "white";
    case Target::board:
      return "board";
    case Target::board_turned:
      return "board_turned";
    case Target::mirror:
      return "mirror";
    case Target::mirror_turned:
      return "mirror_turned";
    case Target::black_trap:
      return "black_trap";
    case Target::black_glass:
      return "black_glass";
    case Target::colour_chart:
      return "colour_chart";
  }
  return "unknown";
}

std::string_view in_words(Target target) {
  switch (target) {
    case Target::sample:
      return "sample";
    case Target::white:
      return "white reference";
    case Target::board:
      return "ChArUco board";
    case Target::board_turned:
      return "ChArUco board, turned by half a turn in its mount";
    case Target::mirror:
      return "flat mirror";
    case Target::mirror_turned:
      return "flat mirror, turned by half a turn in its mount";
    case Target::black_trap:
      return "black trap";
    case Target::black_glass:
      return "black glass";
    case Target::colour_chart:
      return "colour chart";
  }
  return "unknown target";
}

}  // namespace gonio::devices
