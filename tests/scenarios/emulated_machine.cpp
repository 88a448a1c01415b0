#include "emulated_machine.h"

#include <cstdlib>

#include "device_options.h"
#include "gonio/brdf/builtin_materials.h"
#include "gonio/files/text_file.h"
#include "gonio/setup/simulated_rig.h"

namespace gonio {
namespace {

/// No fixed pattern, because it is in a sample's sigma and the same in two sessions of one sensor;
/// a steady lamp: what is looked for are faults.
constexpr const char* kSmaller = R"(
[[bus]]
name = "changer"
type = "modbus_tcp"
host = "127.0.0.1"
tcp_port = 1503
response_timeout_ms = 40
retries = 1

[changer]
bus = "changer"
unit = 1

[[changer.place]]
target = "sample"
number = 1

[[changer.place]]
target = "white"
number = 2

[camera]
width_px = 40
height_px = 32
pixel_format = "bayer_rggb"
fx_px = 172.5
fy_px = 172.5
cx_px = 19.5
cy_px = 15.5
prnu = 0
dsnu_e = 0
readout_us = 2000
[sample]
spot_half_width_mm = 4
grid = 3
[session]
relative_sigma = 0.02
white_frames = 1
dark_frames = 2
sentinel_every = 1
retries = 1
[simulation]
lamp_drift_sigma = 0
white_light = true
change_time_s = 2
)";

std::string replaced(std::string text, const std::string& what, const std::string& by) {
  for (std::size_t at = text.find(what); at != std::string::npos; at = text.find(what, at)) {
    text.replace(at, what.size(), by);
    at += by.size();
  }
  return text;
}

}  // namespace

cli::RigFile small_emulated_rig() {
  const std::filesystem::path path = std::filesystem::path(GONIO_RIGS) / "wire.toml";
  std::string text = files::read_text_file(path, 1 << 20);
  text = replaced(text, "placement = \"in_frame\"", "placement = \"changer\"");
  text = replaced(text, "parity = \"even\"",
                  "parity = \"even\"\nresponse_timeout_ms = 40\nretries = 1");
  // One lamp channel and a colour camera take a third of the frames.
  const std::size_t channels = text.find("[[lamp.channel]]");
  text.replace(
      channels, text.find("[monitor]") - channels,
      "[[lamp.channel]]\nname = \"white\"\nwavelength_nm = 0\nnumber = 1\nlevel = 1000\n\n");
  text = replaced(text, "\"Mono12p\"", "\"BayerRG12p\"");
  text =
      replaced(text, "tcp_port = 1502", "tcp_port = 1502\nresponse_timeout_ms = 40\nretries = 1");
  cli::RigFile rig = cli::rig_file_from_text(text + kSmaller, path);
  for (rig::Axis& axis : rig.rig.axes) axis.settle = std::chrono::milliseconds(50);
  return rig;
}

EmulatedMachine::EmulatedMachine(const cli::RigFile& rig, std::uint64_t noise_seed) {
  sim::SimOptions world = cli::simulated_world(rig, brdf::builtin_materials().front().model, 7);
  world.time_scale = kEmulatedTimeScale;
  world.runs_by_itself = true;
  world.noise_seed = noise_seed;
  emulated_ = std::make_unique<emulate::EmulatedRig>(rig, world,
                                                     std::vector<emulator_faults::FaultRule>(), 1);
  for (const auto& [name, value] : emulated_->environment()) {
    // Its library is part of this program already.
    if (name != "LD_PRELOAD") ::setenv(name.c_str(), value.c_str(), 1);
  }
}

std::vector<std::size_t> EmulatedMachine::moving() {
  std::vector<std::size_t> found;
  for (std::size_t axis = 0; axis < world().axis_count(); ++axis) {
    if (world().joint(axis).arrived_at() > world().clock().now()) found.push_back(axis);
  }
  return found;
}

bool EmulatedMachine::is_lit() {
  constexpr double kDark = 0.1;  // of a lit channel's reading
  return world().lamp_monitor().read() > kDark;
}

DrivenMachine::DrivenMachine(const cli::RigFile& rig)
    : axes_and_lamp_(cli::open_hardware_rig(rig, cli::Parts::axes_and_lamp, {})) {
  cli::Buses buses(rig.devices);
  const cli::ChangerDevice& changer = rig.devices.changer;
  changer_ = std::make_unique<modbus_changer::ModbusChanger>(
      buses[changer.bus], changer.unit, "changer", cli::changer_profile(changer), clock_);
  usbtmc_monitor::MonitorOptions monitor = cli::monitor_options(rig.devices.monitor);
  monitor.answer = std::chrono::milliseconds(100);
  monitor_ = std::make_unique<usbtmc_monitor::UsbtmcMonitor>(
      usb_bus::open_usb_device("monitor", cli::monitor_address(rig.devices.monitor)), monitor);
  aravis_camera::AravisCameraOptions camera = cli::camera_options(rig);
  // Two repetitions of two exposures outlast the second in which a lost camera is noticed.
  camera.frame_margin = std::chrono::milliseconds(400);
  camera.retries = 1;
  camera.open_patience = std::chrono::milliseconds(1000);
  camera_ = std::make_unique<aravis_camera::AravisCamera>(camera, clock_);
  devices_ = axes_and_lamp_->devices();
  devices_.changer = changer_.get();
  devices_.monitor = monitor_.get();
  devices_.camera = camera_.get();
  devices_.clock = &clock_;
}

}  // namespace gonio
