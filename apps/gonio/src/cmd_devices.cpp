#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "command.h"
#include "gonio/opened_rig/connected_devices.h"
#include "json_text.h"

namespace gonio::cli {
namespace {

struct DevicesOptions {
  bool json = false;
};

int list_devices(Context& context, const DevicesOptions& options) {
  const ConnectedDevices found = connected_devices();
  if (options.json) {
    nlohmann::ordered_json result = {{"cameras", nlohmann::ordered_json::array()},
                                     {"serial_ports", nlohmann::ordered_json::array()},
                                     {"usb", nlohmann::ordered_json::array()}};
    for (const FoundCamera& each : found.cameras) {
      result["cameras"].push_back({{"id", each.id},
                                   {"model", each.model},
                                   {"serial", each.serial},
                                   {"address", each.address},
                                   {"protocol", each.protocol}});
    }
    for (const FoundSerialPort& each : found.serial_ports) {
      result["serial_ports"].push_back({{"port", each.port}, {"name", each.name}});
    }
    for (const FoundUsbDevice& each : found.usb) {
      result["usb"].push_back({{"vendor_id", each.vendor_id},
                               {"product_id", each.product_id},
                               {"serial", each.serial},
                               {"product", each.product}});
    }
    context.console.result(json_text(result));
  } else {
    std::string text;
    for (const FoundCamera& each : found.cameras) {
      text +=
          fmt::format("camera   {}  {} {}  {}\n", each.id, each.protocol, each.model, each.address);
    }
    for (const FoundSerialPort& each : found.serial_ports) {
      text += fmt::format("serial   {}  {}\n", each.port, each.name);
    }
    for (const FoundUsbDevice& each : found.usb) {
      text += fmt::format("usb      {:04x}:{:04x}  serial {}  {}\n", each.vendor_id,
                          each.product_id, each.serial.empty() ? "-" : each.serial, each.product);
    }
    if (text.empty()) {
      context.console.say("no camera, serial port or USB device found");
    } else {
      context.console.result(text);
    }
  }
  for (const std::string& line : found.not_looked_for) context.console.warn(line);
  return kSuccess;
}

}  // namespace

void add_devices(const Command& root) {
  auto options = std::make_shared<DevicesOptions>();
  const Command command = root.add(
      "devices", "Cameras, serial ports and USB devices that are connected", "gonio devices");
  command.flag("--json", options->json, "Print JSON");
  command.on_call(options, list_devices);
}

}  // namespace gonio::cli
