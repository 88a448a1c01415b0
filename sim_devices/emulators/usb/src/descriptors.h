#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "emulated_device.h"

namespace gonio::usb_emulator {

struct DeviceDescription {
  std::uint16_t vendor;
  std::uint16_t product;
  std::string manufacturer;
  std::string description;
  std::string serial;
  std::uint8_t interface_class;
  std::uint8_t interface_subclass;
  std::uint8_t interface_protocol;
  std::vector<std::uint8_t> bulk_endpoints;  ///< addresses
};

/// A full-speed device with one interface (USB 2.0, chapter 9.6).
Identity identity_of(const DeviceDescription& device);

/// String descriptor `index`; 0 lists the languages. Empty for one that does not exist.
Bytes string_descriptor(const Identity& identity, std::uint8_t index);

}  // namespace gonio::usb_emulator
