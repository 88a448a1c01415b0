#include <algorithm>
#include <chrono>
#include <future>
#include <utility>

#include "gonio/modbus_emulator/devices.h"

namespace gonio::modbus_emulator {
namespace {

class Changer final : public RegisterDevice {
 public:
  Changer(std::string name, devices::TargetChanger& changer, ChangerLayout layout)
      : name_(std::move(name)), changer_(changer), layout_(std::move(layout)) {}

  const std::string& name() const override { return name_; }
  bool knows_function(std::uint8_t function) const override {
    return function == 0x03 || function == 0x04 || function == 0x06 || function == 0x10;
  }

  std::optional<std::vector<std::uint16_t>> read(Table table, std::uint16_t first,
                                                 std::uint16_t count) override {
    if (count != 1) return std::nullopt;
    if (table == Table::input_registers && first == layout_.status_register) {
      return std::vector<std::uint16_t>{place()};
    }
    if (table == Table::holding_registers && first == layout_.command_register) {
      return std::vector<std::uint16_t>{commanded_};
    }
    return std::nullopt;
  }

  std::optional<Exception> write(Table table, std::uint16_t first,
                                 std::span<const std::uint16_t> values) override {
    if (table != Table::holding_registers || first != layout_.command_register ||
        values.size() != 1) {
      return Exception::illegal_address;
    }
    const auto place =
        std::find_if(layout_.places.begin(), layout_.places.end(),
                     [&](const ChangerLayout::Place& each) { return each.number == values[0]; });
    if (place == layout_.places.end()) return Exception::illegal_value;
    if (on_its_way())
      return commanded_ == values[0] ? std::nullopt : std::optional(Exception::busy);
    commanded_ = values[0];
    // The world's changer returns when it is there, and the line has to answer meanwhile.
    change_ = std::async(std::launch::async, [this, target = place->target] {
      try {
        changer_.mount(target);
      } catch (const devices::DeviceError&) {  // it stays where it stands, and that is what shows
      }
    });
    return std::nullopt;
  }

 private:
  bool on_its_way() const {
    return change_.valid() &&
           change_.wait_for(std::chrono::seconds(0)) != std::future_status::ready;
  }

  std::uint16_t place() const {
    if (on_its_way()) return 0;
    const devices::Target mounted = changer_.mounted();
    for (const ChangerLayout::Place& place : layout_.places) {
      if (place.target == mounted) return place.number;
    }
    return 0;
  }

  std::string name_;
  devices::TargetChanger& changer_;
  ChangerLayout layout_;
  std::uint16_t commanded_ = 0;
  std::future<void> change_;  ///< waits for its end when destroyed
};

}  // namespace

std::unique_ptr<RegisterDevice> changer(std::string name, devices::TargetChanger& changer,
                                        ChangerLayout layout) {
  return std::make_unique<Changer>(std::move(name), changer, std::move(layout));
}

}  // namespace gonio::modbus_emulator
