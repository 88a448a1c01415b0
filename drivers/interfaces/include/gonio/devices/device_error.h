#pragma once

#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>

namespace gonio::devices {

/// Why a device failed, as far as a caller's reaction differs.
enum class DeviceErrc {
  Timeout,         ///< no answer or not settled in time: a retry may help
  Disconnected,    ///< the link or the device is gone: reconnect, identify and home first
  Protocol,        ///< an answer that breaks the protocol (CRC, length, wrong unit): retry
  NotHomed,        ///< the joint angle is not known: home first
  LimitViolation,  ///< refused before anything moved: ask for something else
  Stopped,         ///< stop() is latched: rearm() first
  Fault            ///< the device reports an alarm: a person has to look
};

std::string_view to_string(DeviceErrc code);

/// A device did not do what it was asked. what() is "DEVICE: CODE: message", one line.
class DeviceError : public std::runtime_error {
 public:
  DeviceError(DeviceErrc code, std::string device, const std::string& message);

  DeviceErrc code() const noexcept { return code_; }
  const std::string& device() const noexcept { return device_; }

 private:
  DeviceErrc code_;
  std::string device_;
};

}  // namespace gonio::devices
