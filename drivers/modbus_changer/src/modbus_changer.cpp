#include "gonio/modbus_changer/modbus_changer.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <stdexcept>
#include <utility>

namespace gonio::modbus_changer {

using devices::DeviceErrc;
using devices::DeviceError;

namespace {

constexpr std::chrono::milliseconds kPoll{100};
// One that still says its old place this long after a command was acknowledged does not start.
constexpr std::chrono::seconds kStart{5};

ChangerProfile checked_profile(ChangerProfile profile) {
  profile.validate();
  return profile;
}

}  // namespace

void ChangerProfile::validate() const {
  if (places.empty()) throw std::invalid_argument("changer: place: found none, expected one");
  std::set<devices::Target> targets;
  std::set<std::uint16_t> numbers;
  for (const Place& place : places) {
    const std::string_view target = devices::to_string(place.target);
    if (!targets.insert(place.target).second) {
      throw std::invalid_argument(fmt::format(
          "changer: place: found the target \"{}\" twice, expected different ones", target));
    }
    if (place.number == 0 || !numbers.insert(place.number).second) {
      throw std::invalid_argument(
          fmt::format("changer: place {}: number: found {}, expected a number of its own, from 1",
                      target, place.number));
    }
  }
  if (timeout.count() <= 0) {
    throw std::invalid_argument(
        fmt::format("changer: timeout: found {} ms, expected more than 0", timeout.count()));
  }
}

ModbusChanger::ModbusChanger(std::shared_ptr<modbus_bus::ModbusBus> bus, int unit, std::string name,
                             ChangerProfile profile, devices::Clock& clock)
    : bus_(std::move(bus)),
      station_{std::move(name), unit},
      profile_(checked_profile(std::move(profile))),
      clock_(clock),
      mounted_(target_at(place())) {}

std::uint16_t ModbusChanger::place() const {
  return bus_->ask(station_, modbus_bus::read_input_registers(profile_.status_register))[0];
}

std::uint16_t ModbusChanger::place_of(devices::Target target) const {
  std::string carried;
  for (const ChangerProfile::Place& place : profile_.places) {
    if (place.target == target) return place.number;
    carried += fmt::format("{}{}", carried.empty() ? "" : ", ", devices::to_string(place.target));
  }
  throw DeviceError(DeviceErrc::Fault, name(),
                    fmt::format("carries no {}, only {}", devices::in_words(target), carried));
}

std::optional<devices::Target> ModbusChanger::target_at(std::uint16_t number) const {
  for (const ChangerProfile::Place& place : profile_.places) {
    if (place.number == number) return place.target;
  }
  return std::nullopt;
}

devices::Target ModbusChanger::mounted() const {
  if (mounted_) return *mounted_;
  const std::uint16_t stands = place();
  if (const auto target = target_at(stands)) return *target;
  throw DeviceError(DeviceErrc::Fault, name(),
                    stands == 0 ? std::string("stands between two places; send it to one by hand")
                                : fmt::format("stands at place {}, at which the rig file has no "
                                              "target; send it to another by hand",
                                              stands));
}

void ModbusChanger::mount(devices::Target target) {
  if (mounted_ == target) return;
  const std::uint16_t wanted = place_of(target);
  mounted_.reset();
  // The same place twice is one motion, so a command without an answer may be sent again.
  bus_->ask(station_, modbus_bus::write_register(profile_.command_register, wanted));
  const devices::Clock::Duration sent = clock_.now();
  bool started = false;
  while (true) {
    // Read first: what it says then is no older than the time it is judged by.
    const devices::Clock::Duration asked = clock_.now();
    const std::uint16_t stands = place();
    if (stands == wanted) break;
    started = started || stands == 0;
    if (stands != 0 && (started || asked - sent > kStart)) {
      throw DeviceError(DeviceErrc::Fault, name(),
                        fmt::format("stands at place {} instead of {}: does an axis move, or is "
                                    "the shutter open?",
                                    stands, wanted));
    }
    if (asked - sent > profile_.timeout) {
      throw DeviceError(DeviceErrc::Timeout, name(),
                        fmt::format("not at place {} within {} s", wanted,
                                    std::chrono::duration<double>(profile_.timeout).count()));
    }
    clock_.wait_until(clock_.now() + kPoll);
  }
  mounted_ = target;
}

}  // namespace gonio::modbus_changer
