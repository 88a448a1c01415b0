#include "apt_drive.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <stdexcept>
#include <utility>

namespace gonio::usb_emulator {

using emulator_faults::Fault;

namespace {

constexpr double kStepsPerDeg = 49152000.0 / 360.0;
constexpr double kTurnDeg = 360.0;
constexpr double kOnTheMarkDeg = 0.05;
constexpr double kVelocityUnit = 7329109.0;
constexpr double kAccelerationUnit = 1502.0;
constexpr std::uint8_t kUnitAddress = 0x50;
constexpr std::uint8_t kHostAddress = 0x01;
constexpr std::size_t kHeader = 6;
// "If it has sent 50 of these without the server sending an acknowledgement, it will stop sending
// any more."
constexpr int kStatusLimit = 50;

void put16(Bytes& bytes, std::uint32_t value) {
  bytes.push_back(static_cast<std::uint8_t>(value));
  bytes.push_back(static_cast<std::uint8_t>(value >> 8U));
}
void put32(Bytes& bytes, std::uint32_t value) {
  put16(bytes, value);
  put16(bytes, value >> 16U);
}
std::int32_t get32(const Bytes& bytes, std::size_t at) {
  return static_cast<std::int32_t>(bytes.at(at) | bytes.at(at + 1) << 8U | bytes.at(at + 2) << 16U |
                                   static_cast<std::uint32_t>(bytes.at(at + 3)) << 24U);
}

}  // namespace

AptDrive::AptDrive(AptStageOptions options, sim::Joint& joint, devices::Clock& clock,
                   emulator_faults::FaultPlan& faults)
    : options_(std::move(options)), joint_(joint), clock_(clock), faults_(faults) {
  restart();
}

void AptDrive::restart() {
  const Time now = clock_.now();
  joint_.brake(now);
  zero_ = joint_.encoder(now);
  acceleration_ = static_cast<std::int32_t>(10.0 * kAccelerationUnit);
  velocity_ = static_cast<std::int32_t>(10.0 * kVelocityUnit);
  home_params_.clear();
  put16(home_params_, 1);
  put16(home_params_, 2);
  put16(home_params_, 1);
  put32(home_params_, static_cast<std::uint32_t>(velocity_));
  put32(home_params_, 0);
  enabled_ = homed_ = never_arrives_ = false;
  motion_ = Motion::none;
  alarm_at_.reset();
  limit_at_.reset();
  latched_bits_ = 0;
  unacknowledged_ = 0;
  input_.clear();
  output_.clear();
}

void AptDrive::receive(std::span<const std::uint8_t> bytes) {
  input_.insert(input_.end(), bytes.begin(), bytes.end());
  while (input_.size() >= kHeader) {
    const bool has_data = (input_[4] & 0x80U) != 0;
    const std::size_t size =
        has_data ? static_cast<std::size_t>(input_[2] | input_[3] << 8U) : std::size_t{0};
    if (input_.size() < kHeader + size) return;
    const auto id = static_cast<std::uint16_t>(input_[0] | input_[1] << 8U);
    const std::uint8_t param1 = input_[2];
    const std::uint8_t param2 = input_[3];
    const bool ours = (input_[4] & 0x7FU) == kUnitAddress && input_[5] == kHostAddress;
    const auto data_at = input_.begin() + kHeader;
    const Bytes data(data_at, data_at + static_cast<std::ptrdiff_t>(size));
    input_.erase(input_.begin(), data_at + static_cast<std::ptrdiff_t>(size));
    if (ours && !strikes(Fault::dead_link)) handle(id, param1, param2, data);
  }
}

void AptDrive::handle(std::uint16_t id, std::uint8_t param1, std::uint8_t param2,
                      const Bytes& data) {
  switch (id) {
    case 0x0005: {  // HW_REQ_INFO
      Bytes info;
      put32(info, static_cast<std::uint32_t>(std::stoul(options_.serial)));
      for (std::size_t letter = 0; letter < 8; ++letter) {
        info.push_back(letter < 6 ? static_cast<std::uint8_t>("K10CR1"[letter]) : 0);
      }
      put16(info, 44);          // brushless DC or stepper: type
      put32(info, 0x00010003);  // firmware 1.0.3
      info.resize(78, 0);
      put16(info, 1);
      put16(info, 0);
      put16(info, 1);
      answer(0x0006, info);
      break;
    }
    case 0x0210:  // MOD_SET_CHANENABLESTATE
      if (param1 == 1) enabled_ = param2 == 1;
      break;
    case 0x0211:
      answer_short(0x0212, param1, enabled_ ? 1 : 2);
      break;
    case 0x0411: {  // MOT_REQ_POSCOUNTER
      Bytes counter;
      put16(counter, 1);
      put32(counter, static_cast<std::uint32_t>(position()));
      answer(0x0412, counter);
      break;
    }
    case 0x0413:  // MOT_SET_VELPARAMS
      if (data.size() != 14) break;
      acceleration_ = get32(data, 6);
      velocity_ = get32(data, 10);
      break;
    case 0x0414: {
      Bytes params;
      put16(params, 1);
      put32(params, 0);
      put32(params, static_cast<std::uint32_t>(acceleration_));
      put32(params, static_cast<std::uint32_t>(velocity_));
      answer(0x0415, params);
      break;
    }
    case 0x0429: {  // MOT_REQ_STATUSBITS
      Bytes status;
      put16(status, 1);
      put32(status, bits());
      answer(0x042A, status);
      break;
    }
    case 0x0440:
      if (data.size() == 14) home_params_ = data;
      break;
    case 0x0441:
      answer(0x0442, home_params_);
      break;
    case 0x0443:
      start_homing();
      break;
    case 0x0453:  // MOT_MOVE_ABSOLUTE
      if (data.size() == 6 && !strikes(Fault::lost_move)) start_move(get32(data, 2));
      break;
    case 0x0465:
      stop();
      break;
    case 0x0490:
      send_status(0x0491);
      break;
    case 0x0492:
      unacknowledged_ = 0;
      break;
    default:
      break;  // as the unit does
  }
}

void AptDrive::start_move(std::int32_t target) {
  if (!enabled_) return;
  forward_ = target >= position();
  const double deg = (options_.reversed ? -1.0 : 1.0) * target / kStepsPerDeg;
  joint_.move_to(zero_ + Angle::from_degrees(deg), clock_.now(),
                 sim::Joint::Pace{velocity_ / kVelocityUnit, acceleration_ / kAccelerationUnit});
  motion_ = Motion::moving;
  never_arrives_ = strikes(Fault::never_in_position);
  plan_faults();
}

void AptDrive::start_homing() {
  if (!enabled_) return;
  homed_ = false;
  latched_bits_ &= ~0x3U;  // drives off the switches
  never_arrives_ = false;
  const Time now = clock_.now();
  joint_.lose_steps(Angle::from_degrees(faults_.lost_steps_deg(name(), now)));
  forward_ = home_params_.at(2) == 1;
  const double way = forward_ != options_.reversed ? 1.0 : -1.0;
  const Angle here = joint_.encoder(now);
  const double direct_deg = way * (options_.home - here).degrees();
  double travel_deg = std::fmod(direct_deg, kTurnDeg);
  if (travel_deg < -kOnTheMarkDeg) travel_deg += kTurnDeg;
  home_at_ = here + Angle::from_degrees(way * travel_deg);
  if (std::abs((home_at_ - options_.home).degrees()) < kOnTheMarkDeg) {
    home_at_ = options_.home;
  }
  joint_.start_homing(
      now, home_at_,
      sim::Joint::Pace{get32(home_params_, 6) / kVelocityUnit, acceleration_ / kAccelerationUnit});
  motion_ = Motion::homing;
  plan_faults();
}

/// What is to go wrong under way happens half the way.
void AptDrive::plan_faults() {
  const Time now = clock_.now();
  const Time half_way = now + (joint_.arrived_at() - now) / 2;
  alarm_at_.reset();
  limit_at_.reset();
  if (strikes(Fault::alarm)) alarm_at_ = half_way;
  if (strikes(Fault::limit_switch)) limit_at_ = half_way;
}

void AptDrive::stop() {
  if (strikes(Fault::stop_ignored)) return;
  joint_.brake(clock_.now());
  alarm_at_.reset();
  limit_at_.reset();
  never_arrives_ = false;
  motion_ = Motion::stopping;
}

void AptDrive::step() {
  const Time now = clock_.now();
  const auto brake_with = [&](std::optional<Time>& at, std::uint32_t bit) {
    if (!at || now < *at) return;
    joint_.brake(now);
    latched_bits_ |= bit;
    motion_ = Motion::none;
    at.reset();
  };
  brake_with(alarm_at_, 1U << 24U);
  brake_with(limit_at_, forward_ ? 1U << 0U : 1U << 1U);
  if (motion_ == Motion::none || now < joint_.arrived_at() || never_arrives_) return;
  const Motion done = std::exchange(motion_, Motion::none);
  if (done == Motion::moving) send_status(0x0464);
  if (done == Motion::stopping) send_status(0x0466);
  if (done == Motion::homing) {
    joint_.finish_homing();
    zero_ = home_at_;
    homed_ = true;
    answer_short(0x0444, 1, 0);
  }
}

void AptDrive::send_status(std::uint16_t id) {
  if (unacknowledged_ >= kStatusLimit) return;
  ++unacknowledged_;
  Bytes data;
  put16(data, 1);
  put32(data, static_cast<std::uint32_t>(position()));
  put16(data, 0);
  put16(data, 0);
  put32(data, bits());
  answer(id, data);
}

std::int32_t AptDrive::position() const {
  const double deg = (joint_.counter(clock_.now()) - zero_).degrees();
  return static_cast<std::int32_t>(
      std::lround((options_.reversed ? -1.0 : 1.0) * deg * kStepsPerDeg));
}

std::uint32_t AptDrive::bits() const {
  std::uint32_t bits = latched_bits_ | 1U << 8U | 1U << 28U;  // motor connected, power
  if (motion_ == Motion::homing) bits |= 1U << 9U;
  if (motion_ != Motion::none) bits |= (forward_ ? 1U << 4U : 1U << 5U) | 1U << 29U;
  if (motion_ == Motion::none) bits |= 1U << 13U;
  if (homed_) bits |= 1U << 10U;
  if (enabled_) bits |= 1U << 31U;
  return bits;
}

void AptDrive::answer(std::uint16_t id, const Bytes& data) {
  Bytes bytes;
  put16(bytes, id);
  put16(bytes, static_cast<std::uint32_t>(data.size()));
  bytes.push_back(kHostAddress | 0x80U);
  bytes.push_back(kUnitAddress);
  bytes.insert(bytes.end(), data.begin(), data.end());
  send(std::move(bytes));
}

void AptDrive::answer_short(std::uint16_t id, std::uint8_t param1, std::uint8_t param2) {
  Bytes bytes;
  put16(bytes, id);
  bytes.insert(bytes.end(), {param1, param2, kHostAddress, kUnitAddress});
  send(std::move(bytes));
}

void AptDrive::send(Bytes bytes) {
  if (strikes(Fault::torn_reply)) bytes.resize(bytes.size() / 2);
  output_.insert(output_.end(), bytes.begin(), bytes.end());
}

Bytes AptDrive::take_output() { return std::exchange(output_, {}); }

}  // namespace gonio::usb_emulator
