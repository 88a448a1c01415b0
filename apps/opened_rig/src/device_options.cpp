#include "device_options.h"

#include <fmt/format.h>

#include <optional>

namespace gonio::cli {
namespace {

std::shared_ptr<modbus_bus::ModbusBus> open_bus(const BusEntry& bus, int retries) {
  modbus_bus::BusOptions options;
  options.response_timeout = bus.response_timeout;
  options.retries = retries < 0 ? bus.retries : retries;
  if (bus.kind == BusEntry::Kind::modbus_tcp) {
    return modbus_bus::open_tcp({bus.host, static_cast<std::uint16_t>(bus.tcp_port)}, options);
  }
  constexpr char kParity[] = {'N', 'E', 'O'};
  return modbus_bus::open_rtu(
      {bus.port, bus.baud, kParity[static_cast<std::size_t>(bus.parity)], bus.stop_bits}, options);
}

}  // namespace

std::shared_ptr<modbus_bus::ModbusBus> Buses::operator[](const std::string& name) {
  auto& bus = open_[name];
  if (!bus) bus = open_bus(*devices_.bus(name), retries_);
  return bus;
}

devices::AxisSetup axis_setup(const rig::Axis& axis) {
  devices::AxisSetup setup;
  setup.name = axis.name;
  setup.limits = {axis.min, axis.max};
  setup.home = axis.home;
  setup.max_speed_deg_per_s = axis.max_speed_deg_per_s;
  setup.acceleration_deg_per_s2 = axis.acceleration_deg_per_s2;
  setup.settle = axis.settle;
  return setup;
}

usb_bus::UsbAddress apt_address(const AxisDevice& device) {
  return {apt_stage::kAptVendor, apt_stage::kAptProduct, device.serial, std::nullopt};
}

apt_stage::AptModel apt_model(const std::string& name) {
  const apt_stage::AptModel model = apt_stage::k10cr1();
  if (name == model.name) return model;
  throw std::invalid_argument(
      fmt::format("model: found \"{}\", expected \"{}\"", name, model.name));
}

modbus_light::LampProfile lamp_profile(const LampDevice& lamp) {
  modbus_light::LampProfile profile;
  profile.shutter_coil = static_cast<std::uint16_t>(lamp.shutter_coil);
  profile.channel_register = static_cast<std::uint16_t>(lamp.channel_register);
  profile.temperature_register = static_cast<std::uint16_t>(lamp.temperature_register);
  profile.steady_time = lamp.steady;
  for (std::size_t i = 0; i < lamp.channels.size(); ++i) {
    const LampChannelEntry& channel = lamp.channels[i];
    profile.channels.push_back({channel.name, channel.wavelength_nm,
                                static_cast<std::uint16_t>(channel.number),
                                static_cast<std::uint16_t>(lamp.first_level_register + i),
                                static_cast<std::uint16_t>(channel.level)});
  }
  return profile;
}

modbus_changer::ChangerProfile changer_profile(const ChangerDevice& changer) {
  modbus_changer::ChangerProfile profile;
  profile.command_register = static_cast<std::uint16_t>(changer.command_register);
  profile.status_register = static_cast<std::uint16_t>(changer.status_register);
  profile.timeout = changer.timeout;
  for (const ChangerPlaceEntry& place : changer.places) {
    profile.places.push_back({place.target, static_cast<std::uint16_t>(place.number)});
  }
  return profile;
}

usb_bus::UsbAddress monitor_address(const MonitorDevice& monitor) {
  usb_bus::UsbAddress address;
  if (monitor.vendor_id != 0) address.vendor = static_cast<std::uint16_t>(monitor.vendor_id);
  if (monitor.product_id != 0) address.product = static_cast<std::uint16_t>(monitor.product_id);
  address.serial = monitor.serial;
  address.interface_class = usb_bus::kUsbtmcClass;
  return address;
}

usbtmc_monitor::MonitorOptions monitor_options(const MonitorDevice& monitor) {
  usbtmc_monitor::MonitorOptions options;
  options.query = monitor.query;
  options.zero = monitor.zero;
  return options;
}

aravis_camera::AravisCameraOptions camera_options(const RigFile& rig) {
  const CameraDevice& camera = rig.devices.camera;
  const sim::CameraOptions& nominal = rig.world.camera;
  aravis_camera::AravisCameraOptions options;
  options.name = kCameraName;
  options.device = camera.id;
  options.pixel_format = camera.pixel_format;
  options.region = {camera.offset_x_px, camera.offset_y_px, nominal.width_px, nominal.height_px};
  options.gain_db = camera.gain_db;
  options.gain_raw_per_db = camera.gain_raw_per_db;
  options.black_level_dn = camera.black_level_dn;
  options.black_level_unit_dn = camera.black_level_unit_dn;
  if (camera.trigger != "software") options.trigger_line = camera.trigger;
  options.packet_size = camera.packet_size_bytes;
  options.readout = nominal.readout;
  return options;
}

}  // namespace gonio::cli
