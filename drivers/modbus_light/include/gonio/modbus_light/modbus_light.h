#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "gonio/devices/clock.h"
#include "gonio/devices/light_source.h"
#include "gonio/devices/temperature_sensor.h"
#include "gonio/modbus_bus/modbus_bus.h"

namespace gonio::modbus_light {

/// Where a lamp has what: a coil for the shutter, holding registers for the channel and its level,
/// an input register for the temperature.
struct LampProfile {
  struct Channel {
    std::string name;
    double wavelength_nm = 0.0;        ///< centre; 0 for white
    std::uint16_t number = 0;          ///< what the channel register is set to
    std::uint16_t level_register = 0;  ///< holding
    std::uint16_t level = 0;           ///< what it is set to
  };
  std::uint16_t shutter_coil = 0;      ///< 1: open
  std::uint16_t channel_register = 0;  ///< holding
  std::vector<Channel> channels;
  std::chrono::milliseconds steady_time{0};           ///< after a change, on the session's clock
  std::optional<std::uint16_t> temperature_register;  ///< input, signed
  double temperature_scale = 0.1;                     ///< deg C = scale * number

  /// Throws std::invalid_argument "lamp: FIELD: found ..., expected ...".
  void validate() const;
};

/// A lamp with a shutter and channels on Modbus.
///
/// State    As LightSource. A light() that fails leaves the shutter closed. A shutter that could
/// not
///          be closed, or reads back open, is closed before anything else is done, and while it
///          does not close that is an error of every call.
/// Threads  As LightSource. close_shutter() waits for one transaction of others at most and then
///          makes one attempt; a light() under way on another thread ends with Stopped.
/// Errors   As LightSource; Fault also for a shutter that reads back open.
class ModbusLight final : public devices::LightSource, public devices::TemperatureSensor {
 public:
  /// Closes the shutter. `clock` outlives it. Throws std::invalid_argument, DeviceError.
  ModbusLight(std::shared_ptr<modbus_bus::ModbusBus> bus, int unit, std::string name,
              LampProfile profile, devices::Clock& clock);
  /// Closes the shutter unless it is known to be closed.
  ~ModbusLight() override;

  const std::string& name() const override { return station_.device; }
  std::vector<devices::LightChannel> channels() const override;
  void light(const std::string& channel) override;
  void close_shutter() noexcept override;

  /// Closes the shutter, with all the attempts of the bus, and reads it back: for an end of which
  /// one must be sure. Throws as the bus; Fault when it reads back open.
  void require_closed();

  /// Of the lamp head; Fault where the profile has no register for it.
  double temperature_c() override;

 private:
  const LampProfile::Channel& find(const std::string& channel) const;
  void open_on(const LampProfile::Channel& channel, std::uint64_t closings, bool was_lit);
  void close_and_verify(modbus_bus::Attempts attempts);
  void require_closed_if_asked();

  std::shared_ptr<modbus_bus::ModbusBus> bus_;
  modbus_bus::Station station_;
  LampProfile profile_;
  devices::Clock& clock_;
  std::string lit_;  ///< lit last, if nothing has been closed since `lit_at_closings_`
  std::uint64_t lit_at_closings_ = 0;
  std::atomic<std::uint64_t> closings_ = 0;
  std::atomic<bool> close_failed_ = false;
  std::atomic<bool> may_be_open_ = true;  ///< not read back as closed since it was opened last
};

}  // namespace gonio::modbus_light
