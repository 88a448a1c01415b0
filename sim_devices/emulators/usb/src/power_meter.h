#pragma once

#include <deque>
#include <optional>
#include <string>

#include "emulated_device.h"
#include "gonio/devices/clock.h"
#include "gonio/devices/light_source.h"
#include "gonio/emulator_faults/fault_plan.h"
#include "gonio/usb_emulator/usb_testbed.h"

namespace gonio::usb_emulator {

/// A USBTMC instrument that understands *IDN?, *RST, *CLS, MEAS:POW? and SYST:ERR?.
///
/// Source   USB Test and Measurement Class 1.0, chapters 3 and 4; SCPI-99, volume 2 chapter 21.
class PowerMeter final : public EmulatedDevice {
 public:
  PowerMeter(PowerMeterOptions options, devices::LampMonitor& monitor, devices::Clock& clock,
             emulator_faults::FaultPlan& faults);

  const std::string& name() const override { return options_.name; }
  const Identity& identity() const override { return identity_; }
  std::optional<Bytes> control(const Setup& setup, std::span<const std::uint8_t> data) override;
  void bulk_out(std::span<const std::uint8_t> bytes) override;
  std::optional<Bytes> bulk_in(std::size_t room, Wall::time_point since) override;
  void step() override {}
  void restart() override;
  void cycle_power() override { restart(); }

 private:
  struct Request {
    std::uint8_t tag;
    std::size_t most;
  };

  void message(std::uint8_t id, std::uint8_t tag, std::uint32_t size, bool end,
               std::span<const std::uint8_t> payload);
  void command(std::string text);
  void error(int code, const char* text);
  void clear();

  PowerMeterOptions options_;
  Identity identity_;
  devices::LampMonitor& monitor_;
  devices::Clock& clock_;
  emulator_faults::FaultPlan& faults_;
  std::string input_;
  std::string output_;
  std::optional<Request> request_;
  Bytes leaving_;  ///< of one answer, not yet taken
  bool abort_ends_ = false;
  std::deque<std::string> errors_;
};

}  // namespace gonio::usb_emulator
