#include <cmath>
#include <map>
#include <utility>

#include "drive_core.h"

namespace gonio::modbus_emulator {
namespace {

// Leadshine iEM-RS and CS2RS manuals; where a number comes from third-party driver code it says so.
constexpr std::uint16_t kPulsesPerRevolution = 0x0001;  // Pr0.00
constexpr std::uint16_t kSoftwareEnable = 0x000F;       // Pr0.07
constexpr std::uint16_t kParametersEnd = 0x0200;
constexpr std::uint16_t kMotionState = 0x1003;
constexpr std::uint16_t kMonitorFirst = 0x1010;  // following error, command and feedback position
constexpr std::uint16_t kMonitorEnd = 0x1016;
constexpr std::uint16_t kVelocityFirst = 0x1044;
constexpr std::uint16_t kVelocityEnd = 0x1048;
constexpr std::uint16_t kControlWord = 0x1801;
constexpr std::uint16_t kSaveStatus = 0x1901;
constexpr std::uint16_t kCurrentAlarm = 0x2203;
constexpr std::uint16_t kPathControl = 0x6002;
constexpr std::uint16_t kPr0 =
    0x6200;  // mode, position hi, lo, velocity, accel, decel, dwell, trigger
constexpr std::uint16_t kPr0End = 0x6208;

constexpr std::uint16_t kResetAlarm = 0x1111;
constexpr std::uint16_t kRunPr0 = 0x0010;
constexpr std::uint16_t kHome = 0x0020;  // not found in a manual page
constexpr std::uint16_t kStop = 0x0040;  // third-party
constexpr std::uint16_t kAbsolute = 0x0001;
constexpr std::uint16_t kRelative = 0x0041;
constexpr std::uint16_t kOverCurrent = 0x0001;

std::uint16_t upper(std::int32_t value) {
  return static_cast<std::uint16_t>(static_cast<std::uint32_t>(value) >> 16U);
}
std::uint16_t lower(std::int32_t value) {
  return static_cast<std::uint16_t>(static_cast<std::uint32_t>(value) & 0xFFFFU);
}

class LeadshineDrive final : public RegisterDevice {
 public:
  LeadshineDrive(std::string name, const DriveMechanics& mechanics, Faults faults)
      : core_(std::move(name), mechanics, std::move(faults)) {
    memory_[kPulsesPerRevolution] = 10000;
    memory_[kSoftwareEnable] = 1;
  }

  const std::string& name() const override { return core_.name(); }
  bool knows_function(std::uint8_t function) const override {
    return function == 0x03 || function == 0x06 || function == 0x10;
  }
  bool answers_damaged_requests() const override { return true; }

  std::optional<std::vector<std::uint16_t>> read(Table table, std::uint16_t first,
                                                 std::uint16_t count) override {
    if (table != Table::holding_registers) return std::nullopt;
    const std::int32_t position = core_.feedback_steps();
    std::vector<std::uint16_t> values;
    for (std::uint32_t address = first; address < std::uint32_t{first} + count; ++address) {
      const auto value = at(address, position);
      if (!value) return std::nullopt;
      values.push_back(*value);
    }
    return values;
  }

  std::optional<Exception> write(Table table, std::uint16_t first,
                                 std::span<const std::uint16_t> values) override {
    if (table != Table::holding_registers) return Exception::illegal_function;
    for (std::size_t i = 0; i < values.size(); ++i) {
      if (!writable(first + i)) return Exception::illegal_address;
    }
    for (std::size_t i = 0; i < values.size(); ++i) {
      set(static_cast<std::uint16_t>(first + i), values[i]);
    }
    return std::nullopt;
  }

 private:
  static bool writable(std::size_t address) {
    return address < kParametersEnd || address == kControlWord || address == kPathControl ||
           (address >= kPr0 && address < kPr0End);
  }

  std::optional<std::uint16_t> at(std::uint32_t address, std::int32_t position) {
    if (address < kParametersEnd || (address >= kPr0 && address < kPr0End)) {
      const auto found = memory_.find(static_cast<std::uint16_t>(address));
      return found == memory_.end() ? std::uint16_t{0} : found->second;
    }
    if (address >= kVelocityFirst && address < kVelocityEnd) return std::uint16_t{0};
    if (address >= kMonitorFirst && address < kMonitorEnd) {
      const std::int32_t command = core_.command_steps();
      const std::int32_t values[] = {0, command, position};
      const std::int32_t value = values[(address - kMonitorFirst) / 2];
      return (address - kMonitorFirst) % 2 == 0 ? upper(value) : lower(value);
    }
    switch (address) {
      case kMotionState:
        return motion_state();
      case kSaveStatus:
        return std::uint16_t{0x1111};
      case kCurrentAlarm:
        return core_.trouble() == DriveCore::Trouble::alarm ? kOverCurrent : std::uint16_t{0};
      case kControlWord:
      case kPathControl:
        return std::uint16_t{0};
      default:
        return std::nullopt;
    }
  }

  std::uint16_t motion_state() {
    unsigned state = 0;
    if (core_.trouble() == DriveCore::Trouble::alarm) state |= 1U;
    if (memory_[kSoftwareEnable] != 0) state |= 1U << 1U;
    if (core_.moving()) state |= 1U << 2U;
    if (core_.completed()) state |= (1U << 4U) | (1U << 5U);
    if (core_.homed()) state |= 1U << 6U;
    return static_cast<std::uint16_t>(state);
  }

  void set(std::uint16_t address, std::uint16_t value) {
    if (address == kControlWord) {
      if (value == kResetAlarm) core_.reset_alarm();
    } else if (address == kPathControl || address == kPr0 + 7) {
      command(value);
    } else {
      memory_[address] = value;
    }
  }

  void command(std::uint16_t value) {
    if (value == kStop) {
      core_.stop();
    } else if (memory_[kSoftwareEnable] == 0) {
      return;
    } else if (value == kRunPr0) {
      run_pr0();
    } else if (value == kHome) {
      core_.home();
    }
  }

  void run_pr0() {
    // A run into a limit switch is over with the next command, as on the real ones.
    if (core_.trouble() == DriveCore::Trouble::limit_switch) core_.reset_alarm();
    const std::int64_t position =
        static_cast<std::int32_t>((std::uint32_t{memory_[kPr0 + 1]} << 16U) | memory_[kPr0 + 2]);
    const double steps_per_revolution = memory_[kPulsesPerRevolution];
    const double steps_per_s = memory_[kPr0 + 3] / 60.0 * steps_per_revolution;
    const double seconds_per_1000_rpm = memory_[kPr0 + 4] / 1000.0;
    const double steps_per_s2 = 1000.0 / 60.0 * steps_per_revolution / seconds_per_1000_rpm;
    if (memory_[kPr0] == kAbsolute) {
      core_.move_to(position, steps_per_s, steps_per_s2);
    } else if (memory_[kPr0] == kRelative) {
      core_.move_to(core_.feedback_steps() + position, steps_per_s, steps_per_s2);
    }
  }

  DriveCore core_;
  std::map<std::uint16_t, std::uint16_t> memory_;
};

}  // namespace

std::unique_ptr<RegisterDevice> leadshine_drive(std::string name, const DriveMechanics& mechanics,
                                                Faults faults) {
  return std::make_unique<LeadshineDrive>(std::move(name), mechanics, std::move(faults));
}

}  // namespace gonio::modbus_emulator
