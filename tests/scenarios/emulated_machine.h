#pragma once

#include <chrono>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "emulated_rig.h"
#include "gonio/acquisition/session.h"
#include "gonio/aravis_camera/aravis_camera.h"
#include "gonio/devices/steady_clock.h"
#include "gonio/emulator_faults/fault_plan.h"
#include "gonio/modbus_changer/modbus_changer.h"
#include "gonio/opened_rig/opened_rig.h"
#include "gonio/setup/rig_file.h"
#include "gonio/sim/sim_goniometer.h"
#include "gonio/usbtmc_monitor/usbtmc_monitor.h"

/// What `gonio-emulate` puts on the wire, and the drivers at its other end, in one process: faults
/// come when a test says, and it looks at the emulated world itself.
namespace gonio {

/// Seconds of the emulated world and the session in one of the host's.
inline constexpr double kEmulatedTimeScale = 100.0;

/// rigs/wire.toml with a target changer, fast axes and 40 x 32 px, so that a session takes less
/// than a second.
cli::RigFile small_emulated_rig();

/// The emulated machine. One at a time in a process, in a network of its own (PrivateLoopback).
class EmulatedMachine {
 public:
  /// `noise_seed` of shot noise and readings alone: the rig and its hidden errors are the same.
  EmulatedMachine(const cli::RigFile& rig, std::uint64_t noise_seed);

  emulator_faults::FaultPlan& faults() { return emulated_->faults(); }
  sim::SimGoniometer& world() { return emulated_->world(); }

  /// Axes that are on their way, by index.
  std::vector<std::size_t> moving();
  /// Whether light reaches the lamp's monitor.
  bool is_lit();

 private:
  std::unique_ptr<emulate::EmulatedRig> emulated_;
};

/// The drivers of the machine's devices: axes and lamp opened as the program does, with its
/// watchdog; changer, monitor and camera with less patience than on a rig of metal, since every
/// silence is waited out in the host's time.
class DrivenMachine {
 public:
  explicit DrivenMachine(const cli::RigFile& rig);

  const acquisition::DeviceSet& devices() const { return devices_; }
  /// As the program at its end. Throws devices::DeviceError.
  void require_safe() { axes_and_lamp_->require_safe(); }

 private:
  devices::SteadyClock clock_{kEmulatedTimeScale};
  std::unique_ptr<cli::OpenedRig> axes_and_lamp_;
  std::unique_ptr<modbus_changer::ModbusChanger> changer_;
  std::unique_ptr<usbtmc_monitor::UsbtmcMonitor> monitor_;
  std::unique_ptr<aravis_camera::AravisCamera> camera_;
  acquisition::DeviceSet devices_;
};

}  // namespace gonio
