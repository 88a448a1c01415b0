#include <algorithm>
#include <utility>

#include "gonio/modbus_emulator/devices.h"

namespace gonio::modbus_emulator {
namespace {

constexpr std::uint16_t kTemperature = 312;  // 0.1 deg C

class Lamp final : public RegisterDevice {
 public:
  Lamp(std::string name, devices::LightSource& light, const LampLayout& layout)
      : name_(std::move(name)), light_(light), layout_(layout), channels_(light.channels()) {
    levels_.assign(channels_.size(), 0);
  }

  const std::string& name() const override { return name_; }
  bool knows_function(std::uint8_t function) const override {
    return (function >= 0x03 && function <= 0x06) || function == 0x01 || function == 0x0F ||
           function == 0x10;
  }

  std::optional<std::vector<std::uint16_t>> read(Table table, std::uint16_t first,
                                                 std::uint16_t count) override {
    std::vector<std::uint16_t> values;
    for (std::size_t address = first; address < std::size_t{first} + count; ++address) {
      const std::uint16_t* value = find(table, address);
      if (value == nullptr) return std::nullopt;
      values.push_back(*value);
    }
    return values;
  }

  std::optional<Exception> write(Table table, std::uint16_t first,
                                 std::span<const std::uint16_t> values) override {
    if (table == Table::input_registers) return Exception::illegal_address;
    for (std::size_t i = 0; i < values.size(); ++i) {
      const std::uint16_t* value = find(table, first + i);
      if (value == nullptr) return Exception::illegal_address;
      const bool is_channel = value == &channel_;
      if (is_channel && values[i] > channels_.size()) return Exception::illegal_value;
      if (!is_channel && value != &shutter_ && values[i] > layout_.full_level) {
        return Exception::illegal_value;
      }
    }
    for (std::size_t i = 0; i < values.size(); ++i) *find(table, first + i) = values[i];
    shine();
    return std::nullopt;
  }

 private:
  std::uint16_t* find(Table table, std::size_t address) {
    switch (table) {
      case Table::coils:
        return address == layout_.shutter_coil ? &shutter_ : nullptr;
      case Table::input_registers:
        return address == layout_.temperature_register ? &temperature_ : nullptr;
      case Table::holding_registers:
        break;
    }
    if (address == layout_.channel_register) return &channel_;
    if (address < layout_.first_level_register) return nullptr;
    const std::size_t index = address - layout_.first_level_register;
    return index < levels_.size() ? &levels_[index] : nullptr;
  }

  void shine() {
    if (shutter_ != 0 && channel_ != 0 && levels_[channel_ - 1U] > 0) {
      light_.light(channels_[channel_ - 1U].name);
    } else {
      light_.close_shutter();
    }
  }

  std::string name_;
  devices::LightSource& light_;
  LampLayout layout_;
  std::vector<devices::LightChannel> channels_;
  std::uint16_t shutter_ = 0;
  std::uint16_t channel_ = 0;
  std::uint16_t temperature_ = kTemperature;
  std::vector<std::uint16_t> levels_;
};

}  // namespace

std::unique_ptr<RegisterDevice> lamp(std::string name, devices::LightSource& light,
                                     const LampLayout& layout) {
  return std::make_unique<Lamp>(std::move(name), light, layout);
}

}  // namespace gonio::modbus_emulator
