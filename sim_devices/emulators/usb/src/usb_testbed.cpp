#include "gonio/usb_emulator/usb_testbed.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <stdexcept>

#include "apt_drive.h"
#include "ftdi_chip.h"
#include "machine.h"
#include "power_meter.h"

namespace gonio::usb_emulator {

UsbTestbed::UsbTestbed(emulator_faults::FaultPlan& faults, devices::Clock& clock)
    : machine_(std::make_unique<Machine>(faults, clock)) {}
UsbTestbed::~UsbTestbed() = default;

void UsbTestbed::add_apt_stage(const AptStageOptions& options, sim::Joint& joint) {
  const bool decimal = !options.serial.empty() && options.serial.size() <= 9 &&
                       std::all_of(options.serial.begin(), options.serial.end(),
                                   [](char letter) { return letter >= '0' && letter <= '9'; });
  if (options.name.empty() || !decimal) {
    throw std::invalid_argument(
        fmt::format("APT stage \"{}\": serial: found \"{}\", expected up to nine digits",
                    options.name, options.serial));
  }
  auto drive = std::make_unique<AptDrive>(options, joint, machine_->clock, machine_->faults);
  machine_->add(std::make_unique<FtdiChip>(std::move(drive), options.serial));
}

void UsbTestbed::add_power_meter(const PowerMeterOptions& options, devices::LampMonitor& monitor) {
  if (options.name.empty() || options.serial.empty()) {
    throw std::invalid_argument("power meter: expected a name and a serial");
  }
  machine_->add(std::make_unique<PowerMeter>(options, monitor, machine_->clock, machine_->faults));
}

void UsbTestbed::add_serial_port(const std::string& port, const std::string& terminal) {
  namespace fs = std::filesystem;
  if (!port.starts_with("/dev/") || !terminal.starts_with("/dev/")) {
    throw std::invalid_argument("serial port " + port + " at " + terminal +
                                ": expected two files in /dev");
  }
  const fs::path link = machine_->directory() + port;
  fs::create_directories(link.parent_path());
  fs::create_symlink(terminal, link);
}

void UsbTestbed::unplug(const std::string& name) { machine_->unplug(name); }
void UsbTestbed::plug_in(const std::string& name) { machine_->plug_in(name); }
void UsbTestbed::cycle_power(const std::string& name) { machine_->cycle_power(name); }

std::filesystem::path UsbTestbed::folder() const { return machine_->directory(); }

std::vector<std::pair<std::string, std::string>> UsbTestbed::environment() const {
  return {{"UMOCKDEV_DIR", machine_->directory()}, {"LD_PRELOAD", GONIO_UMOCKDEV_PRELOAD}};
}

}  // namespace gonio::usb_emulator
