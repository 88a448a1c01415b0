#pragma once

#include <chrono>
#include <memory>
#include <string>
#include <string_view>

#include "gonio/usb_bus/usb_device.h"
#include "gonio/usbtmc_monitor/host_clock.h"
#include "gonio/usbtmc_monitor/usbtmc_message.h"

namespace gonio::usbtmc_monitor {

/// Commands and answers over the bulk endpoints of one USBTMC interface.
///
/// Bounds   Everything up to the next begin() is over within the time that was given there, and one
///          transfer.
/// Threads  One.
/// Errors   DeviceError: Timeout, Protocol, Disconnected. After the first two recover() first.
class UsbtmcPipe {
 public:
  using Deadline = std::chrono::milliseconds;

  UsbtmcPipe(std::shared_ptr<usb_bus::UsbDevice> device, Deadline answer, HostClock now)
      : device_(std::move(device)), answer_(answer), now_(std::move(now)) {}

  usb_bus::UsbDevice& device() { return *device_; }

  /// From here on all that is asked and all recovery take `within` together; Timeout after that.
  void begin(Deadline within) { end_ = now_() + within; }
  bool time_is_up() const { return now_() >= end_; }

  void send(std::string_view command);
  /// The answer to exactly this command: one to an earlier request, which comes late, is dropped by
  /// its tag. Begins with the recovery that had no time left, if there was one.
  std::string query(std::string_view command);

  /// Aborts the answer under way and empties the instrument's buffers (sections 4.2.1.4
  /// and 4.2.1.6), so that nothing of what went wrong is taken for the next answer. Throws
  /// Disconnected only.
  void recover();

 private:
  std::string receive();
  Bytes transfer_in(std::chrono::steady_clock::time_point end, std::size_t& wanted);
  void abort_answer();
  void clear();
  void drain();
  Deadline left(Deadline most) const;
  Bytes class_request(std::uint8_t type, std::uint8_t request, std::uint16_t value,
                      std::uint16_t index, std::size_t size);

  std::shared_ptr<usb_bus::UsbDevice> device_;
  Deadline answer_;
  HostClock now_;
  std::uint8_t tag_ = 0;
  std::chrono::steady_clock::time_point end_{};
  bool to_recover_ = false;  ///< an earlier recovery ran out of time
};

}  // namespace gonio::usbtmc_monitor
