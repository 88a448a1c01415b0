#pragma once

#include <cstdint>
#include <string>

#include "gonio/modbus_emulator/devices.h"

namespace gonio::modbus_emulator {

/// What the emulated drives have in common, whatever their registers: position in steps, motion,
/// homing, and the faults of drives. Nothing runs by itself: the mechanics are closed formulas of
/// the world's time, and what has happened since the last look is found at the next.
class DriveCore {
 public:
  enum class Trouble { none, alarm, limit_switch };

  /// `absolute_encoder`: it knows its position after a power failure.
  DriveCore(std::string name, const DriveMechanics& mechanics, Faults faults,
            bool absolute_encoder = false);

  const std::string& name() const { return name_; }

  /// Absolute; nothing while trouble stands. Speeds are positive, else it stays where it is.
  void move_to(std::int64_t steps, double steps_per_s, double steps_per_s2);
  void home();
  void stop();
  void reset_alarm();

  std::int32_t feedback_steps();
  std::int32_t command_steps() const { return static_cast<std::int32_t>(target_steps_); }
  bool moving();
  bool completed();  ///< the last move or homing arrived
  bool homed();
  Trouble trouble();

 private:
  enum class Doing { nothing, moving, homing };

  void look();
  void lose_power();
  bool strikes(emulator_faults::Fault fault);
  bool stopped_halfway_by_fault(Angle target, const sim::Joint::Pace& pace);
  devices::Clock::Duration now() const { return mechanics_.clock->now(); }

  std::string name_;
  DriveMechanics mechanics_;
  Faults faults_;
  bool absolute_encoder_;
  Angle zero_;  ///< joint angle of position 0
  Doing doing_ = Doing::nothing;
  bool completed_ = false;
  bool never_completes_ = false;
  bool homed_ = false;
  Trouble trouble_ = Trouble::none;
  Trouble coming_ = Trouble::none;  ///< when the axis arrives
  std::int64_t target_steps_ = 0;
};

}  // namespace gonio::modbus_emulator
