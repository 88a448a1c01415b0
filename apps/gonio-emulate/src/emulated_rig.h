#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "gonio/emulator_faults/fault_plan.h"
#include "gonio/setup/rig_file.h"
#include "gonio/sim/sim_goniometer.h"
#include "gonio/sim/sim_options.h"
#include "time_account.h"

namespace gonio::emulate {

/// A whole rig of virtual hardware: the world of a rig file, and every device it names on its wire.
///
/// Names    Fault rules speak of the devices by the rig file's names: an axis, "lamp", "changer",
///          "monitor", "camera".
/// Threads  The emulators' own; members from one thread.
class EmulatedRig {
 public:
  /// `world` must run by itself. Throws cli::UsageError for what cannot be emulated (a drive
  /// profile of its own, an address that is not this machine's), std::runtime_error and
  /// std::system_error when a port is taken.
  EmulatedRig(const cli::RigFile& rig, const sim::SimOptions& world,
              std::vector<emulator_faults::FaultRule> faults, std::uint64_t seed);
  ~EmulatedRig();
  EmulatedRig(const EmulatedRig&) = delete;
  EmulatedRig& operator=(const EmulatedRig&) = delete;

  /// What a program inside the emulated machine has in its environment.
  std::map<std::string, std::string> environment() const;

  /// Of the emulated machine's files; gone with it.
  std::filesystem::path folder() const;

  /// One line for every device: its name and where it answers.
  std::vector<std::string> addresses() const;

  /// Where the time of a command went.
  TimeAccount account(const Interval& command) const;

  // For who lives in the same process: what goes wrong from now on, and what is true behind it all.
  emulator_faults::FaultPlan& faults();
  sim::SimGoniometer& world();

 private:
  class Parts;
  std::unique_ptr<Parts> parts_;
  double time_scale_;
};

}  // namespace gonio::emulate
