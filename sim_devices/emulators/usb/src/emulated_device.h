#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace gonio::usb_emulator {

using Bytes = std::vector<std::uint8_t>;
using Wall = std::chrono::steady_clock;

/// The setup packet of a control transfer (USB 2.0, 9.3).
struct Setup {
  std::uint8_t request_type;
  std::uint8_t request;
  std::uint16_t value;
  std::uint16_t index;
  std::uint16_t length;
};

/// What a device tells about itself when it is plugged in.
struct Identity {
  Bytes descriptors;  ///< device, then configuration, as the kernel's "descriptors" file has them
  std::vector<std::string> strings;  ///< from index 1
};

/// The function behind the plug. Called with the machine's lock held.
class EmulatedDevice {
 public:
  virtual ~EmulatedDevice() = default;
  EmulatedDevice(const EmulatedDevice&) = delete;
  EmulatedDevice& operator=(const EmulatedDevice&) = delete;

  virtual const std::string& name() const = 0;
  virtual const Identity& identity() const = 0;

  /// Vendor and class requests. Returns the data of an inward one; nothing: a stall.
  virtual std::optional<Bytes> control(const Setup& setup, std::span<const std::uint8_t> data) = 0;
  virtual void bulk_out(std::span<const std::uint8_t> bytes) = 0;
  /// What a bulk inward transfer of `room` bytes gives that waits since `since`; nothing: not yet.
  virtual std::optional<Bytes> bulk_in(std::size_t room, Wall::time_point since) = 0;

  /// Lets time pass.
  virtual void step() = 0;
  /// As when it is plugged in.
  virtual void restart() = 0;
  /// The power of what lies behind the USB chip goes and comes.
  virtual void cycle_power() = 0;

 protected:
  EmulatedDevice() = default;
};

}  // namespace gonio::usb_emulator
