#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "gonio/devices/clock.h"
#include "gonio/devices/target_changer.h"
#include "gonio/modbus_bus/modbus_bus.h"

namespace gonio::modbus_changer {

/// Where a changer has what, and what it carries.
struct ChangerProfile {
  struct Place {
    devices::Target target{};
    std::uint16_t number = 0;  ///< of the place, from 1
  };
  std::uint16_t command_register = 0;  ///< holding: number of the place to go to
  std::uint16_t status_register = 0;   ///< input: number of the place it stands at, 0 on its way
  std::vector<Place> places;
  std::chrono::milliseconds timeout{120'000};  ///< of one change, on the session's clock

  /// Throws std::invalid_argument "changer: FIELD: found ..., expected ...".
  void validate() const;
};

/// A motorised target changer on Modbus: a wheel or a slide with numbered places.
///
/// State    What it said last, and after a change that failed what it says when asked. Its own
///          controller sees to homing and comes to rest by itself when this program dies.
/// Threads  As TargetChanger.
/// Errors   As TargetChanger, and as the bus. Fault: it carries no such target, stays where it
///          stands, or stands at a place that has no name. Timeout: not there in time.
class ModbusChanger final : public devices::TargetChanger {
 public:
  /// Moves nothing. `clock` outlives it. Throws std::invalid_argument, DeviceError.
  ModbusChanger(std::shared_ptr<modbus_bus::ModbusBus> bus, int unit, std::string name,
                ChangerProfile profile, devices::Clock& clock);

  const std::string& name() const override { return station_.device; }
  devices::Target mounted() const override;
  void mount(devices::Target target) override;

 private:
  std::uint16_t place() const;
  std::uint16_t place_of(devices::Target target) const;
  std::optional<devices::Target> target_at(std::uint16_t place) const;

  std::shared_ptr<modbus_bus::ModbusBus> bus_;
  modbus_bus::Station station_;
  ChangerProfile profile_;
  devices::Clock& clock_;
  std::optional<devices::Target> mounted_;  ///< none: not known
};

}  // namespace gonio::modbus_changer
