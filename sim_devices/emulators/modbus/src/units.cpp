#include "units.h"

#include <fmt/format.h>

#include <stdexcept>
#include <utility>

namespace gonio::modbus_emulator {

using emulator_faults::Fault;

Units::Units(Faults faults, const devices::Clock& clock)
    : faults_(std::move(faults)), clock_(clock) {}

void Units::add(int unit, std::unique_ptr<RegisterDevice> device) {
  const std::lock_guard lock(mutex_);
  if (unit < 1 || unit > 247) {
    throw std::invalid_argument(
        fmt::format("{}: unit: found {}, expected 1 to 247", device->name(), unit));
  }
  const std::string name = device->name();
  if (!devices_.emplace(unit, std::move(device)).second) {
    throw std::invalid_argument(
        fmt::format("{}: unit: found {}, which {} has", name, unit, devices_.at(unit)->name()));
  }
}

Units::Reaction Units::react(int unit, std::span<const std::uint8_t> pdu) {
  const std::lock_guard lock(mutex_);
  const auto found = devices_.find(unit);
  if (found == devices_.end() || pdu.empty()) return {};
  RegisterDevice& device = *found->second;
  const auto now = clock_.now();
  if (faults_ && faults_->strikes(Fault::dead_link, device.name(), now)) return {};
  if (faults_ && faults_->strikes(Fault::exception, device.name(), now)) {
    return {Delivery::whole, exception_pdu(pdu[0], Exception::device_failure)};
  }
  const Delivery how = delivery(device.name());
  return {how, answer(device, pdu)};
}

Units::Reaction Units::react_to_damage(int unit, std::uint8_t function) {
  const std::lock_guard lock(mutex_);
  const auto found = devices_.find(unit);
  if (found == devices_.end() || !found->second->answers_damaged_requests()) return {};
  return {Delivery::whole, exception_pdu(function, Exception::damaged_request)};
}

Units::Delivery Units::delivery(const std::string& device) {
  const auto now = clock_.now();
  const auto strikes = [&](Fault fault) { return faults_ && faults_->strikes(fault, device, now); };
  if (strikes(Fault::late_reply)) return Delivery::late;
  if (strikes(Fault::torn_reply)) return Delivery::torn;
  if (strikes(Fault::crc_error)) return Delivery::damaged;
  if (strikes(Fault::foreign_reply)) {
    return foreign_++ % 2 == 0 ? Delivery::of_another_unit : Delivery::to_another_request;
  }
  return Delivery::whole;
}

}  // namespace gonio::modbus_emulator
