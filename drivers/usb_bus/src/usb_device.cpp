#include "gonio/usb_bus/usb_device.h"

#include <fmt/format.h>

namespace gonio::usb_bus {

std::string to_string_of_id(std::uint16_t vendor, std::uint16_t product) {
  return fmt::format("{:04x}:{:04x}", vendor, product);
}

std::string UsbAddress::to_string() const {
  const auto part = [](const std::optional<std::uint16_t>& id) {
    return id ? fmt::format("{:04x}", *id) : std::string("any");
  };
  std::string text = part(vendor) + ":" + part(product);
  if (!serial.empty()) text += ", serial " + serial;
  return text;
}

}  // namespace gonio::usb_bus
