#pragma once

#include <deque>
#include <optional>
#include <string>

#include "emulated_device.h"
#include "gonio/devices/clock.h"
#include "gonio/emulator_faults/fault_plan.h"
#include "gonio/sim/joint.h"
#include "gonio/usb_emulator/usb_testbed.h"

namespace gonio::usb_emulator {

/// The controller inside a K10CR1: bytes of its serial line in and out, a joint turned.
///
/// Source   Thorlabs, "Motion Controllers Host-Controller Communications Protocol", issue 25.
class AptDrive {
 public:
  AptDrive(AptStageOptions options, sim::Joint& joint, devices::Clock& clock,
           emulator_faults::FaultPlan& faults);

  const std::string& name() const { return options_.name; }

  void receive(std::span<const std::uint8_t> bytes);
  Bytes take_output();
  void step();
  void restart();

 private:
  using Time = devices::Clock::Duration;
  enum class Motion { none, moving, homing, stopping };

  bool strikes(emulator_faults::Fault fault) {
    return faults_.strikes(fault, name(), clock_.now());
  }
  void handle(std::uint16_t id, std::uint8_t param1, std::uint8_t param2, const Bytes& data);
  void start_move(std::int32_t target);
  void start_homing();
  void plan_faults();
  void stop();
  void answer(std::uint16_t id, const Bytes& data);
  void answer_short(std::uint16_t id, std::uint8_t param1, std::uint8_t param2);
  void send(Bytes bytes);
  void send_status(std::uint16_t id);
  std::int32_t position() const;
  std::uint32_t bits() const;

  AptStageOptions options_;
  sim::Joint& joint_;
  devices::Clock& clock_;
  emulator_faults::FaultPlan& faults_;

  std::deque<std::uint8_t> input_;
  Bytes output_;

  Angle zero_;     ///< joint angle of position 0
  Angle home_at_;  ///< where the homing under way finds the mark: whole turns from `home`
  std::int32_t acceleration_;
  std::int32_t velocity_;
  Bytes home_params_;
  bool enabled_ = false;
  bool homed_ = false;
  bool forward_ = true;
  Motion motion_ = Motion::none;
  bool never_arrives_ = false;
  std::optional<Time> alarm_at_;
  std::optional<Time> limit_at_;
  std::uint32_t latched_bits_ = 0;
  int unacknowledged_ = 0;
};

}  // namespace gonio::usb_emulator
