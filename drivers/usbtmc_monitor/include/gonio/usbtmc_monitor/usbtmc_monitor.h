#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <string>

#include "gonio/devices/light_source.h"
#include "gonio/usb_bus/usb_device.h"
#include "gonio/usbtmc_monitor/host_clock.h"

namespace gonio::usbtmc_monitor {

class UsbtmcPipe;

/// How the instrument is read.
struct MonitorOptions {
  std::string query = "MEAS:POW?";
  double zero = 0.0;  ///< what it shows in the dark, in its own unit; taken off every reading
  std::chrono::milliseconds answer{1000};  ///< for one answer, host time
};

/// Who it is, as *IDN? says (IEEE 488.2, 10.14).
struct InstrumentIdentity {
  std::string manufacturer;
  std::string model;
  std::string serial;
  std::string firmware;
};

/// An optical power meter with USBTMC and SCPI as the lamp's monitor.
///
/// State    The constructor identifies it. Unplugged, it is looked for again at the next read(), by
///          its USB serial; one that then calls itself by another serial is let go of again.
/// Retries  A reading is asked for up to kAttempts times after Timeout and Protocol, each time with
///          the instrument's buffers emptied first.
/// Time     The host's. read() takes at most kAttempts + 1 times MonitorOptions::answer (the last
/// for
///          the instrument's own error) and kRecovery, whatever the instrument does; when it was
///          unplugged, kReconnect and as much again for its identification before. One transfer of
///          0.3 s may be under way at the end.
/// Threads  One controlling thread.
/// Errors   DeviceError: Timeout; Protocol (also an answer that is no plain number); Disconnected;
///          Fault with the instrument's own words (SYST:ERR?), or when it is out of its range.
class UsbtmcMonitor final : public devices::LampMonitor {
 public:
  static constexpr int kAttempts = 3;
  static constexpr std::chrono::milliseconds kReconnect{3000};
  /// Of all recoveries of one reading together, and its transfers besides the answers.
  static constexpr std::chrono::milliseconds kRecovery{1000};

  /// Throws std::invalid_argument for an empty query, a zero that is not finite, no time.
  explicit UsbtmcMonitor(std::shared_ptr<usb_bus::UsbDevice> device, MonitorOptions options = {},
                         HostClock now = std::chrono::steady_clock::now);
  ~UsbtmcMonitor() override;

  const std::string& name() const override { return name_; }
  double read() override;

  const InstrumentIdentity& identity() const { return identity_; }

 private:
  /// Throws Protocol for what is no SCPI instrument.
  InstrumentIdentity identify();
  void reconnect();
  void begin();
  double read_once();
  /// Asks again, the instrument's buffers emptied, after Timeout and Protocol.
  template <class Question>
  auto repeated(Question question, const std::function<void()>& before_giving_up);
  /// Throws Fault when the instrument has an error of its own to tell.
  void require_no_error();

  std::string name_;
  MonitorOptions options_;
  std::unique_ptr<UsbtmcPipe> pipe_;
  InstrumentIdentity identity_;
};

}  // namespace gonio::usbtmc_monitor
