#pragma once

#include <chrono>
#include <string>
#include <vector>

#include "gonio/devices/target_changer.h"

namespace gonio::cli {

/// Which devices a rig of metal has, and where they are: data only, opened by the programs.

/// A port that several devices may share.
struct BusEntry {
  enum class Kind { modbus_rtu, modbus_tcp };
  enum class Parity { none, even, odd };

  std::string name;
  Kind kind = Kind::modbus_rtu;
  std::string port;  ///< RTU: device file
  int baud = 115200;
  Parity parity = Parity::even;
  int stop_bits = 1;
  std::string host;  ///< TCP: name or address
  int tcp_port = 502;
  std::chrono::milliseconds response_timeout{200};
  int retries = 2;  ///< of a request that got no answer or a broken one
};

struct AxisDevice {
  enum class Driver { modbus, apt };

  Driver driver = Driver::modbus;
  // modbus
  std::string bus;
  int unit = 1;
  std::string profile;                 ///< shipped name, or a file beside the rig file
  std::vector<std::string> confirmed;  ///< registers of the profile the user answers for
  double steps_per_deg = 0.0;          ///< of the drive's position registers
  // apt
  std::string serial;
  std::string model = "K10CR1";
  enum class HomeDirection { falling, rising };
  HomeDirection home_direction =
      HomeDirection::falling;  ///< of the joint angle, searching the mark

  bool reversed = false;            ///< the drive counts against the joint angle
  bool counts_until_homed = false;  ///< in its old zero: the user has seen it
};

struct LampChannelEntry {
  std::string name;
  double wavelength_nm = 0.0;
  int number = 0;  ///< what the lamp's channel register calls it
  int level = 0;   ///< what is written to its level register
};

struct LampDevice {
  std::string bus;
  int unit = 1;
  int shutter_coil = 0;
  int channel_register = 0;
  int first_level_register = 1;  ///< of the first channel; the others follow
  int temperature_register = 0;  ///< input register, 0.1 deg C
  std::chrono::milliseconds steady{50};
  std::vector<LampChannelEntry> channels;
};

struct ChangerPlaceEntry {
  devices::Target target = devices::Target::sample;
  int number = 0;  ///< what the changer's registers call the place
};

struct ChangerDevice {
  std::string bus;  ///< empty: the rig has none, a person changes the targets
  int unit = 1;
  int command_register = 0;  ///< holding: number of the place to go to
  int status_register = 0;   ///< input: number of the place it stands at, 0 on its way
  std::chrono::milliseconds timeout{120'000};
  std::vector<ChangerPlaceEntry> places;

  bool carries(devices::Target target) const;
};

struct MonitorDevice {
  std::string serial;  ///< empty: the rig has none
  int vendor_id = 0;
  int product_id = 0;
  std::string query = "MEAS:POW?";
  double zero = 0.0;  ///< what it shows in the dark, in its own unit
};

struct CameraDevice {
  std::string id;  ///< as `gonio devices` names it, or an IP address
  std::string pixel_format = "Mono12p";
  int offset_x_px = 0;
  int offset_y_px = 0;
  double gain_db = 0.0;
  double gain_raw_per_db = 0.0;
  double black_level_dn = 0.0;
  double black_level_unit_dn = 1.0;
  std::string trigger = "software";  ///< or the name of an input line
  int packet_size_bytes = 0;         ///< 0: the largest that gets through
};

struct RigDevices {
  std::vector<BusEntry> buses;
  std::vector<AxisDevice> axes;  ///< one per axis of the rig
  LampDevice lamp;
  ChangerDevice changer;
  MonitorDevice monitor;
  CameraDevice camera;

  /// nullptr when there is none of that name.
  const BusEntry* bus(const std::string& name) const;
};

}  // namespace gonio::cli
