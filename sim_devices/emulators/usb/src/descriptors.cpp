#include "descriptors.h"

namespace gonio::usb_emulator {
namespace {

constexpr std::uint8_t kDevice = 1;
constexpr std::uint8_t kConfiguration = 2;
constexpr std::uint8_t kString = 3;
constexpr std::uint8_t kInterface = 4;
constexpr std::uint8_t kEndpoint = 5;
constexpr std::uint8_t kBulk = 2;
constexpr std::uint8_t kFullSpeedPacket = 64;
constexpr std::uint16_t kEnglish = 0x0409;

std::uint8_t low(std::uint16_t value) { return static_cast<std::uint8_t>(value); }
std::uint8_t high(std::uint16_t value) { return static_cast<std::uint8_t>(value >> 8U); }

}  // namespace

Identity identity_of(const DeviceDescription& device) {
  Identity identity;
  identity.strings = {device.manufacturer, device.description, device.serial};
  const auto endpoints = static_cast<std::uint8_t>(device.bulk_endpoints.size());
  const auto total = static_cast<std::uint16_t>(9 + 9 + 7 * endpoints);
  identity.descriptors = {
      18, kDevice, 0x00, 0x02, 0, 0, 0, kFullSpeedPacket, low(device.vendor), high(device.vendor),
      low(device.product), high(device.product), 0x00, 0x06, 1, 2, 3, 1,
      // one configuration, bus-powered with at most 100 mA
      9, kConfiguration, low(total), high(total), 1, 1, 0, 0x80, 50, 9, kInterface, 0, 0, endpoints,
      device.interface_class, device.interface_subclass, device.interface_protocol, 2};
  for (const std::uint8_t address : device.bulk_endpoints) {
    const Bytes endpoint{7, kEndpoint, address, kBulk, kFullSpeedPacket, 0, 0};
    identity.descriptors.insert(identity.descriptors.end(), endpoint.begin(), endpoint.end());
  }
  return identity;
}

Bytes string_descriptor(const Identity& identity, std::uint8_t index) {
  if (index == 0) return {4, kString, low(kEnglish), high(kEnglish)};
  if (index > identity.strings.size()) return {};
  const std::string& text = identity.strings[index - 1U];
  Bytes bytes{static_cast<std::uint8_t>(2 + 2 * text.size()), kString};
  for (const char letter : text) {
    bytes.push_back(static_cast<std::uint8_t>(letter));
    bytes.push_back(0);
  }
  return bytes;
}

}  // namespace gonio::usb_emulator
