#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "gonio/devices/clock.h"
#include "gonio/devices/light_source.h"
#include "gonio/devices/target_changer.h"
#include "gonio/emulator_faults/fault_plan.h"
#include "gonio/modbus_emulator/register_device.h"
#include "gonio/sim/joint.h"
#include "gonio/units/angle.h"

namespace gonio::modbus_emulator {

using Faults = std::shared_ptr<emulator_faults::FaultPlan>;

/// What a drive is bolted to. Joint and clock belong to the world and outlive the drive.
///
/// Position  The drive counts from where it stood when it was powered up; from its homing on, 0 is
///           the home mark.
struct DriveMechanics {
  sim::Joint* joint = nullptr;
  const devices::Clock* clock = nullptr;
  Angle home;                    ///< joint angle of the home mark
  double steps_per_deg = 100.0;  ///< of the joint
  bool reversed = false;         ///< rising steps turn the joint clockwise
};

/// Leadshine EM2RS / CS2RS / iEM-RS: PR mode, functions 03, 06 and 10. It answers a damaged request
/// with exception 08. 10000 steps make a revolution of the motor, as delivered.
/// Faults: alarm (over-current), limit_switch (stops, completes nothing), never_in_position,
/// stop_ignored, power_cycle (counts from where it stands), lost_steps. While it homes it counts on
/// in its old zero, which no manual at hand says of the drive of metal.
std::unique_ptr<RegisterDevice> leadshine_drive(std::string name, const DriveMechanics& mechanics,
                                                Faults faults);

/// Oriental Motor AZ: direct data operation, functions 03, 06, 08 and 10. Faults as above; a limit
/// switch raises alarm 66h, a power cycle leaves its position known, and it loses no steps.
std::unique_ptr<RegisterDevice> az_drive(std::string name, const DriveMechanics& mechanics,
                                         Faults faults);

/// Where the emulated lamp has what.
struct LampLayout {
  std::uint16_t shutter_coil = 0;          ///< 1: open
  std::uint16_t channel_register = 0;      ///< holding: number of the channel, from 1; 0: none
  std::uint16_t first_level_register = 1;  ///< holding, of channel 1: 0 to full_level
  std::uint16_t full_level = 1000;
  std::uint16_t temperature_register = 0;  ///< input: 0.1 deg C, constant
};

/// The generic lamp in front of a world's light, which outlives it. A channel whose level is 0 does
/// not shine; other levels do not dim it.
std::unique_ptr<RegisterDevice> lamp(std::string name, devices::LightSource& light,
                                     const LampLayout& layout = {});

/// Where the emulated target changer has what, and what it carries.
struct ChangerLayout {
  struct Place {
    devices::Target target{};
    std::uint16_t number = 0;
  };
  std::uint16_t command_register = 0;  ///< holding: number of the place to go to
  std::uint16_t status_register = 0;   ///< input: number of the place it stands at, 0 on its way
  std::vector<Place> places;
};

/// The generic changer in front of a world's, which outlives it. Busy (06) while it is on its way
/// elsewhere; where the world refuses the change it stays where it stands.
std::unique_ptr<RegisterDevice> changer(std::string name, devices::TargetChanger& changer,
                                        ChangerLayout layout);

}  // namespace gonio::modbus_emulator
