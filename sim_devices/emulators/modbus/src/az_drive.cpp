#include <array>
#include <utility>

#include "drive_core.h"

namespace gonio::modbus_emulator {
namespace {

// Oriental Motor AZ (HM-60262E, by way of two open drivers that cite it); 32 bits, upper word
// first.
constexpr std::uint16_t kDirectData = 0x0058;  // number, type, position, speed, start/change rate,
                                               // stop rate, current, trigger, forwarding
constexpr std::size_t kDirectWords = 18;
constexpr std::size_t kFields = kDirectWords / 2;
enum Field : std::size_t {
  kNumber,
  kType,
  kPosition,
  kSpeed,
  kStartRate,
  kStopRate,
  kCurrent,
  kTrigger
};
constexpr std::uint16_t kDriverInput = 0x007C;
constexpr std::uint16_t kDriverOutput = 0x007E;
constexpr std::uint16_t kPresentAlarm = 0x0080;  // not found in a page at hand
constexpr std::uint16_t kFeedbackPosition = 0x0120;
constexpr std::uint16_t kCommandPosition = 0x0122;

constexpr unsigned kInZhome = 1U << 4U;
constexpr unsigned kInStop = 1U << 5U;
constexpr unsigned kInAlarmReset = 1U << 7U;
constexpr unsigned kOutReady = 1U << 5U;
constexpr unsigned kOutAlarm = 1U << 7U;
constexpr unsigned kOutBusy = 1U << 8U;
constexpr unsigned kOutMove = 1U << 13U;
constexpr unsigned kOutInPosition = 1U << 14U;

constexpr std::int32_t kStartNow = 1;
constexpr std::int32_t kStartWithSpeed = -4;
constexpr std::int32_t kStartWithPosition = -5;
constexpr std::int32_t kOverload = 0x30;
constexpr std::int32_t kHardwareOvertravel = 0x66;

class AzDrive final : public RegisterDevice {
 public:
  AzDrive(std::string name, const DriveMechanics& mechanics, Faults faults)
      : core_(std::move(name), mechanics, std::move(faults), true) {}

  const std::string& name() const override { return core_.name(); }
  bool knows_function(std::uint8_t function) const override {
    return function == 0x03 || function == 0x06 || function == 0x08 || function == 0x10;
  }

  std::optional<std::vector<std::uint16_t>> read(Table table, std::uint16_t first,
                                                 std::uint16_t count) override {
    if (table != Table::holding_registers) return std::nullopt;
    const std::int32_t position = core_.feedback_steps();
    std::vector<std::uint16_t> words;
    for (std::uint32_t address = first; address < std::uint32_t{first} + count; ++address) {
      const auto value = value_at(address & ~1U, position);
      if (!value) return std::nullopt;
      const auto bits = static_cast<std::uint32_t>(*value);
      words.push_back(static_cast<std::uint16_t>(address % 2 == 0 ? bits >> 16U : bits & 0xFFFFU));
    }
    return words;
  }

  std::optional<Exception> write(Table table, std::uint16_t first,
                                 std::span<const std::uint16_t> values) override {
    if (table != Table::holding_registers) return Exception::illegal_function;
    const std::size_t end = first + values.size();
    const bool direct = first >= kDirectData && end <= kDirectData + kDirectWords;
    const bool input = first >= kDriverInput && end <= kDriverInput + 2U;
    if (!direct && !input) return Exception::illegal_address;
    for (std::size_t i = 0; i < values.size(); ++i) set(first + i, values[i]);
    return std::nullopt;
  }

 private:
  std::optional<std::int32_t> value_at(std::uint32_t address, std::int32_t position) {
    if (address >= kDirectData && address < kDirectData + kDirectWords) {
      return static_cast<std::int32_t>(direct_[(address - kDirectData) / 2]);
    }
    switch (address) {
      case kDriverInput:
        return static_cast<std::int32_t>(input_);
      case kDriverOutput:
        return static_cast<std::int32_t>(output());
      case kPresentAlarm:
        return alarm();
      case kFeedbackPosition:
        return position;
      case kCommandPosition:
        return core_.command_steps();
      default:
        return std::nullopt;
    }
  }

  std::int32_t alarm() {
    switch (core_.trouble()) {
      case DriveCore::Trouble::alarm:
        return kOverload;
      case DriveCore::Trouble::limit_switch:
        return kHardwareOvertravel;
      case DriveCore::Trouble::none:
        return 0;
    }
    return 0;
  }

  unsigned output() {
    const bool moving = core_.moving();
    unsigned bits = 0;
    if (moving) bits |= kOutMove | kOutBusy;
    if (alarm() != 0) {
      bits |= kOutAlarm;
    } else if (!moving) {
      bits |= kOutReady;
    }
    if (core_.completed()) bits |= kOutInPosition;
    return bits;
  }

  void set(std::size_t address, std::uint16_t word) {
    if (address >= kDriverInput) {
      if (address == kDriverInput + 1U) set_input(word);
      return;
    }
    const std::size_t field = (address - kDirectData) / 2;
    std::uint32_t& value = direct_[field];
    const bool upper = (address - kDirectData) % 2 == 0;
    value = upper ? (value & 0xFFFFU) | (std::uint32_t{word} << 16U) : (value & 0xFFFF0000U) | word;
    if (upper) return;
    const auto trigger = static_cast<std::int32_t>(direct_[kTrigger]);
    const bool starts = (field == kTrigger && trigger == kStartNow) ||
                        (field == kSpeed && trigger == kStartWithSpeed) ||
                        (field == kPosition && trigger == kStartWithPosition);
    if (starts) start();
    if (field == kTrigger && trigger == kStartNow) value = 0;
  }

  void start() {
    if ((input_ & kInStop) != 0) return;
    const auto position = static_cast<std::int32_t>(direct_[kPosition]);
    const double speed_hz = static_cast<std::int32_t>(direct_[kSpeed]);
    const double rate = static_cast<std::int32_t>(direct_[kStartRate]);  // 0.001 kHz/s
    switch (direct_[kType]) {
      case 1:
        core_.move_to(position, speed_hz, rate);
        break;
      case 2:
        core_.move_to(std::int64_t{core_.command_steps()} + position, speed_hz, rate);
        break;
      case 3:
        core_.move_to(std::int64_t{core_.feedback_steps()} + position, speed_hz, rate);
        break;
      default:
        break;
    }
  }

  void set_input(unsigned word) {
    const unsigned risen = word & ~input_;
    input_ = word;
    if ((risen & kInAlarmReset) != 0) core_.reset_alarm();
    if ((risen & kInStop) != 0) core_.stop();
    if ((risen & kInZhome) != 0 && (word & kInStop) == 0) core_.home();
  }

  DriveCore core_;
  std::array<std::uint32_t, kFields> direct_{};
  unsigned input_ = 0;
};

}  // namespace

std::unique_ptr<RegisterDevice> az_drive(std::string name, const DriveMechanics& mechanics,
                                         Faults faults) {
  return std::make_unique<AzDrive>(std::move(name), mechanics, std::move(faults));
}

}  // namespace gonio::modbus_emulator
