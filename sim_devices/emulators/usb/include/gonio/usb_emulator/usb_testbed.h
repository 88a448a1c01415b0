#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "gonio/devices/clock.h"
#include "gonio/devices/light_source.h"
#include "gonio/emulator_faults/fault_plan.h"
#include "gonio/sim/joint.h"
#include "gonio/units/angle.h"

/// USB devices that are not there, on the system call interface of Linux: real libusb enumerates,
/// opens and claims them (umockdev).
namespace gonio::usb_emulator {

class Machine;

/// A Thorlabs K10CR1 behind its FT232 chip (0403:faf0).
struct AptStageOptions {
  std::string name;    ///< of the device in fault rules
  std::string serial;  ///< decimal, as on the case: both the USB string and the unit's own number
  Angle home;          ///< joint angle of the home mark
  bool reversed = false;  ///< counts down where the joint angle goes up
};

/// An optical power meter with USBTMC and SCPI (1313:8078).
struct PowerMeterOptions {
  std::string name;
  std::string serial;
};

/// An emulated machine with USB devices, and serial ports that stand for pseudo-terminals.
///
/// World    The stage's drive has a state machine of its own and turns a sim::Joint on the world's
///          clock; the meter reads a LampMonitor. Both speak their protocols from their documents,
///          not from the drivers.
/// Homing   The stage turns in the direction it is told until the mark comes round. With the mark
///          behind it that is the long way, and the joint then stands a turn from its home angle.
///          Meanwhile it counts on in its old zero, which no document at hand says of a real one.
/// Seen by  Programs that have the preload library loaded and UMOCKDEV_DIR set: the one that hosts
/// the
///          testbed (it links the library by linking this target), and any other started with
///          environment(). Claims, and what is under way, end with the process that made them.
/// Faults   dead_link, torn_reply, stall and unplug on both devices; alarm, limit_switch,
///          lost_move, lost_steps, never_in_position and stop_ignored on the stage. An alarm stands
///          until the power is cycled, a limit switch until homing. unplug() and its siblings do it
///          by hand.
/// Limits   One testbed in a process at a time. Programs that hold devices are to end before it:
/// the
///          preload library aborts them otherwise.
/// Threads  One of its own, and umockdev's; both end with the testbed. Members from one thread.
class UsbTestbed {
 public:
  /// All must outlive it. `clock` is the world's. Throws std::runtime_error when umockdev refuses.
  UsbTestbed(emulator_faults::FaultPlan& faults, devices::Clock& clock);
  ~UsbTestbed();
  UsbTestbed(const UsbTestbed&) = delete;
  UsbTestbed& operator=(const UsbTestbed&) = delete;

  /// Plugs a device in. Throws std::invalid_argument for a serial or name that cannot be.
  void add_apt_stage(const AptStageOptions& options, sim::Joint& joint);
  void add_power_meter(const PowerMeterOptions& options, devices::LampMonitor& monitor);

  /// Lets `port`, such as "/dev/ttyUSB0", stand for a pseudo-terminal, such as "/dev/pts/3".
  void add_serial_port(const std::string& port, const std::string& terminal);

  // By name; std::out_of_range for an unknown one.
  void unplug(const std::string& name);
  void plug_in(const std::string& name);
  /// The unit restarts: not homed, no alarm, motor off. USB stays.
  void cycle_power(const std::string& name);

  /// What a program needs in its environment to see all this: UMOCKDEV_DIR and LD_PRELOAD.
  std::vector<std::pair<std::string, std::string>> environment() const;

  /// Of the machine's files, in the folder for temporary ones; gone with the testbed.
  std::filesystem::path folder() const;

 private:
  std::unique_ptr<Machine> machine_;
};

}  // namespace gonio::usb_emulator
