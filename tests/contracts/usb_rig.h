#pragma once

#include <memory>
#include <string>
#include <utility>

#include "gonio/apt_stage/apt_stage.h"
#include "gonio/brdf/diffuse_models.h"
#include "gonio/sim/sim_goniometer.h"
#include "gonio/usb_bus/ftdi_port.h"
#include "gonio/usb_emulator/usb_testbed.h"
#include "gonio/usbtmc_monitor/usbtmc_monitor.h"

namespace gonio::contracts {

/// A world that runs by itself, its azimuth axis behind an emulated K10CR1, its lamp monitor behind
/// an emulated power meter.
struct UsbRig {
  static constexpr double kTimeScale = 25.0;
  static constexpr std::size_t kAxis = 1;
  static constexpr const char* kStageName = "azimuth";
  static constexpr const char* kStageSerial = "55000123";
  static constexpr const char* kMeterName = "monitor";
  static constexpr const char* kMeterSerial = "P0001234";

  explicit UsbRig(bool reversed_stage = false) : UsbRig(reversed_stage, options()) {}
  UsbRig(bool reversed_stage, const sim::SimOptions& world_options)
      : world(world_options), bed(faults, world.clock()), reversed(reversed_stage) {
    bed.add_apt_stage({kStageName, kStageSerial, axis().home, reversed}, world.joint(kAxis));
    bed.add_power_meter({kMeterName, kMeterSerial}, world.lamp_monitor());
  }

  static sim::SimOptions options(double time_scale = kTimeScale) {
    auto plate = std::make_shared<brdf::Lambertian>(brdf::Rgb::Constant(0.8));
    sim::SimOptions options = sim::nominal_options(std::move(plate), 1);
    options.time_scale = time_scale;
    options.runs_by_itself = true;
    options.rig.axes[kAxis].max_speed_deg_per_s = 10.0;
    options.rig.axes[kAxis].acceleration_deg_per_s2 = 20.0;
    return options;
  }

  /// As gonio-emulate's command line writes it.
  void add_fault(const std::string& rule) {
    faults.add(emulator_faults::fault_rule_from_text(rule));
  }

  const rig::Axis& axis() const { return world.truth().rig.axes[kAxis]; }

  devices::AxisSetup setup() const {
    return {kStageName,
            {axis().min, axis().max},
            axis().home,
            axis().max_speed_deg_per_s,
            axis().acceleration_deg_per_s2,
            axis().settle};
  }

  static usb_bus::UsbAddress stage_address() {
    return {apt_stage::kAptVendor, apt_stage::kAptProduct, kStageSerial, std::nullopt};
  }

  static std::shared_ptr<usb_bus::FtdiPort> open_port() {
    return std::make_shared<usb_bus::FtdiPort>(
        usb_bus::open_usb_device(kStageName, stage_address()));
  }

  std::shared_ptr<apt_stage::AptStage> stage_on(std::shared_ptr<usb_bus::ByteStream> port) {
    return std::make_shared<apt_stage::AptStage>(
        std::move(port), setup(), apt_stage::k10cr1(), reversed, world.clock(),
        apt_stage::HomeDirection::falling, counts_until_homed);
  }

  std::shared_ptr<apt_stage::AptStage> open_stage() { return stage_on(open_port()); }

  static usb_bus::UsbAddress meter_address() {
    return {std::nullopt, std::nullopt, kMeterSerial, usb_bus::kUsbtmcClass};
  }

  static std::shared_ptr<usbtmc_monitor::UsbtmcMonitor> open_meter(
      const usbtmc_monitor::MonitorOptions& options = {}) {
    return std::make_shared<usbtmc_monitor::UsbtmcMonitor>(
        usb_bus::open_usb_device(kMeterName, meter_address()), options);
  }

  sim::SimGoniometer world;
  emulator_faults::FaultPlan faults;
  usb_emulator::UsbTestbed bed;
  bool reversed;
  bool counts_until_homed = false;  ///< of the stages opened from now on
};

}  // namespace gonio::contracts
