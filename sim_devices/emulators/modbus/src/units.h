#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <span>

#include "gonio/devices/clock.h"
#include "gonio/emulator_faults/fault_plan.h"
#include "gonio/modbus_emulator/devices.h"
#include "gonio/modbus_emulator/frames.h"

namespace gonio::modbus_emulator {

/// The devices of one line or server by their unit ids, and what the faults make of their answers.
///
/// Threads  All members from any thread.
class Units {
 public:
  enum class Delivery { whole, none, late, torn, damaged, of_another_unit, to_another_request };
  struct Reaction {
    Delivery delivery = Delivery::none;
    Bytes pdu;
  };

  /// `clock` is the world's and outlives this.
  Units(Faults faults, const devices::Clock& clock);

  /// Throws std::invalid_argument: a unit outside 1 to 247 or one that is there already.
  void add(int unit, std::unique_ptr<RegisterDevice> device);

  /// To a request of one unit; a unit that is not here does not answer.
  Reaction react(int unit, std::span<const std::uint8_t> pdu);
  /// To a request of RTU whose checksum is wrong.
  Reaction react_to_damage(int unit, std::uint8_t function);

 private:
  Delivery delivery(const std::string& device);

  std::mutex mutex_;
  std::map<int, std::unique_ptr<RegisterDevice>> devices_;
  Faults faults_;
  const devices::Clock& clock_;
  unsigned foreign_ = 0;
};

}  // namespace gonio::modbus_emulator
