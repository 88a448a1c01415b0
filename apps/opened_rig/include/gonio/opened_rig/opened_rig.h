#pragma once

#include <map>
#include <memory>
#include <stop_token>
#include <string>
#include <vector>

#include "gonio/acquisition/session.h"
#include "gonio/setup/rig_file.h"
#include "gonio/sim/sim_options.h"

namespace gonio::cli {

/// What one device says it is.
struct DeviceIdentity {
  std::string device;    ///< as the rig file names it: "tilt", "lamp", "camera"
  std::string identity;  ///< model, serial number, firmware, as far as it tells; one line
};

/// Which devices a command needs open. Axes and lamp always come, so that it can end safely.
enum class Parts {
  axes_and_lamp,  ///< to move by hand
  all             ///< with camera and monitor
};

/// The devices of a rig, open and owned.
///
/// State    Closing it, by whatever way, stops the axes and closes the shutter. While the devices
/// of
///          a rig of metal are open, a watchdog process does the same should this one be killed.
class OpenedRig {
 public:
  virtual ~OpenedRig() = default;
  OpenedRig(const OpenedRig&) = delete;
  OpenedRig& operator=(const OpenedRig&) = delete;

  virtual const acquisition::DeviceSet& devices() = 0;
  virtual std::vector<DeviceIdentity> identities() = 0;
  /// Stops everything and makes sure: throws devices::DeviceError when an axis does not stand or
  /// the shutter is not closed, or when that cannot be known. For the end of a program.
  virtual void require_safe() = 0;
  /// Session seconds in one of the host's; other than 1 for emulated rigs only.
  virtual double time_scale() const { return 1.0; }

 protected:
  OpenedRig() = default;
};

/// Who the devices are, as a calibration keeps it: device -> what it says of itself.
std::map<std::string, std::string> serials_of(OpenedRig& rig);

/// A world in this process.
std::unique_ptr<OpenedRig> open_simulated_rig(const sim::SimOptions& world);

/// Reads drive profiles and checks what the drivers will be told; opens nothing. Throws UsageError,
/// ConfigError. open_hardware_rig() does it first.
void check_hardware_options(const RigFile& rig);

/// What the rig file says of its devices: driver, address, registers of a profile that nobody has
/// confirmed. Opens nothing; empty for a simulated rig. Throws UsageError, ConfigError.
std::vector<DeviceIdentity> named_devices(const RigFile& rig);

/// The devices that a rig file with driver "hardware" names, held against other processes
/// (RigLock). Throws devices::DeviceError naming the one that does not answer, UsageError for one
/// whose library this program was built without. A `stop` is heard before each device, within 3 s
/// also while a silent camera is waited for, and ends as DeviceError, Stopped, with all ports
/// closed again.
std::unique_ptr<OpenedRig> open_hardware_rig(const RigFile& rig, Parts parts,
                                             const std::stop_token& stop);

/// Either, by the rig's driver; a simulated one holds a plain grey plate and comes from `seed`.
std::unique_ptr<OpenedRig> open_rig(const RigFile& rig, Parts parts, const std::stop_token& stop,
                                    std::uint64_t seed = 1);

}  // namespace gonio::cli
