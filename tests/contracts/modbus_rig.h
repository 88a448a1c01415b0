#pragma once

#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "gonio/brdf/diffuse_models.h"
#include "gonio/devices/steady_clock.h"
#include "gonio/emulator_faults/fault_plan.h"
#include "gonio/modbus_bus/open_bus.h"
#include "gonio/modbus_changer/modbus_changer.h"
#include "gonio/modbus_emulator/devices.h"
#include "gonio/modbus_emulator/rtu_line.h"
#include "gonio/modbus_emulator/tcp_server.h"
#include "gonio/modbus_light/modbus_light.h"
#include "gonio/modbus_stage/modbus_stage.h"
#include "gonio/setup/drive_profile_file.h"
#include "gonio/sim/sim_goniometer.h"
#include "temporary_folder.h"

/// Emulated Modbus devices of one world, and the drivers over their wires.
namespace gonio::contracts {

using namespace std::chrono_literals;

enum class Family { leadshine, az };

inline constexpr std::chrono::milliseconds kPatience{300000};  // of the world's time
constexpr double kTimeScale = 50.0;
constexpr std::chrono::milliseconds kLateBy{250};
constexpr double kStepsPerDeg = 1000.0;

inline std::vector<emulator_faults::FaultRule> rules(const std::vector<std::string>& texts) {
  std::vector<emulator_faults::FaultRule> made;
  for (const std::string& text : texts) made.push_back(emulator_faults::fault_rule_from_text(text));
  return made;
}

inline sim::SimOptions running_world_options(double time_scale = kTimeScale) {
  sim::SimOptions options =
      sim::nominal_options(std::make_shared<brdf::Lambertian>(brdf::Rgb::Constant(0.8)), 1);
  options.time_scale = time_scale;
  options.runs_by_itself = true;
  return options;
}

/// Every target has a place.
inline const std::vector<modbus_changer::ChangerProfile::Place>& places() {
  static const auto kPlaces = [] {
    std::vector<modbus_changer::ChangerProfile::Place> all;
    for (int i = 0; i <= static_cast<int>(devices::Target::colour_chart); ++i) {
      all.push_back({static_cast<devices::Target>(i), static_cast<std::uint16_t>(i + 1)});
    }
    return all;
  }();
  return kPlaces;
}

/// A world with every axis a drive of one family on one RTU line (units 1, 2, 3), a lamp (unit 1)
/// and a target changer (unit 2) behind TCP.
class ModbusRig {
 public:
  explicit ModbusRig(Family family, const std::vector<std::string>& faults = {},
                     modbus_bus::BusOptions bus_options = {},
                     const sim::SimOptions& world = running_world_options())
      : family_(family),
        bus_options_(bus_options),
        world_(world),
        faults_(std::make_shared<emulator_faults::FaultPlan>(rules(faults))),
        clock_(world.time_scale.value()) {
    plug_in_line();
    plug_in_server();
  }

  void unplug_line() { line_.reset(); }
  void plug_in_line() {
    line_.emplace(
        modbus_emulator::ModbusRtuLine::Options{.late_by = kLateBy, .link = folder_ / "port"},
        faults_, world_.clock());
    for (std::size_t axis = 0; axis < world_.axis_count(); ++axis) {
      const rig::Axis& described = world_.truth().rig.axes[axis];
      const modbus_emulator::DriveMechanics mechanics{&world_.joint(axis), &world_.clock(),
                                                      described.home, kStepsPerDeg, axis == 1};
      line_->add(static_cast<int>(axis) + 1,
                 family_ == Family::leadshine
                     ? modbus_emulator::leadshine_drive(described.name, mechanics, faults_)
                     : modbus_emulator::az_drive(described.name, mechanics, faults_));
    }
  }

  void unplug_server() { server_.reset(); }
  void plug_in_server() {
    server_.emplace(
        modbus_emulator::ModbusTcpServer::Options{.port = server_port_, .late_by = kLateBy},
        faults_, world_.clock());
    server_port_ = server_->port();
    server_->add(1, modbus_emulator::lamp("lamp", world_.light_source()));
    modbus_emulator::ChangerLayout layout;
    for (const auto& place : places()) layout.places.push_back({place.target, place.number});
    server_->add(2, modbus_emulator::changer("changer", world_.target_changer(), layout));
  }

  sim::SimGoniometer& world() { return world_; }
  emulator_faults::FaultPlan& faults() { return *faults_; }
  modbus_emulator::ModbusRtuLine& line() { return *line_; }
  devices::Clock& clock() { return clock_; }

  std::shared_ptr<modbus_bus::ModbusBus> rtu() {
    if (!rtu_) rtu_ = modbus_bus::open_rtu({line_->port()}, bus_options_);
    return rtu_;
  }
  std::shared_ptr<modbus_bus::ModbusBus> tcp() {
    return modbus_bus::open_tcp({"127.0.0.1", server_port_}, bus_options_);
  }

  modbus_stage::StageOptions stage_options() const {
    modbus_stage::StageOptions options;
    options.confirmed = family_ == Family::leadshine ? std::vector<std::string>{"home", "stop"}
                                                     : std::vector<std::string>{"present_alarm"};
    options.poll_interval = 2ms;
    options.arrival_patience = 200ms;
    options.counts_until_homed = counts_until_homed;
    return options;
  }

  std::unique_ptr<modbus_stage::ModbusStage> stage(std::size_t axis) {
    const rig::Axis& described = world_.truth().rig.axes[axis];
    const devices::AxisSetup setup{described.name,
                                   {described.min, described.max},
                                   described.home,
                                   described.max_speed_deg_per_s,
                                   described.acceleration_deg_per_s2,
                                   described.settle};
    return std::make_unique<modbus_stage::ModbusStage>(
        rtu(), static_cast<int>(axis) + 1, setup,
        cli::shipped_drive_profile(family_ == Family::leadshine ? "leadshine-em2rs"
                                                                : "oriental-az"),
        modbus_stage::DriveScale{kStepsPerDeg, axis == 1}, clock_, stage_options());
  }

  std::unique_ptr<modbus_light::ModbusLight> light() {
    modbus_light::LampProfile profile;
    const auto channels = world_.light_source().channels();
    for (std::size_t i = 0; i < channels.size(); ++i) {
      const auto number = static_cast<std::uint16_t>(i + 1);  // registers of the levels from 1 on
      profile.channels.push_back(
          {channels[i].name, channels[i].wavelength_nm, number, number, 1000});
    }
    profile.temperature_register = 0;
    profile.steady_time = 100ms;
    return std::make_unique<modbus_light::ModbusLight>(tcp(), 1, "lamp", profile, clock_);
  }

  std::unique_ptr<modbus_changer::ModbusChanger> changer() {
    modbus_changer::ChangerProfile profile;
    profile.places = places();
    return std::make_unique<modbus_changer::ModbusChanger>(tcp(), 2, "changer", profile, clock_);
  }

  bool counts_until_homed = false;  ///< of the stages made from now on

 private:
  Family family_;
  modbus_bus::BusOptions bus_options_;
  sim::SimGoniometer world_;
  std::shared_ptr<emulator_faults::FaultPlan> faults_;
  TemporaryFolder folder_;  ///< of the port's name, which outlives the line behind it
  std::optional<modbus_emulator::ModbusRtuLine> line_;
  std::uint16_t server_port_ = 0;
  std::optional<modbus_emulator::ModbusTcpServer> server_;
  devices::SteadyClock clock_;
  std::shared_ptr<modbus_bus::ModbusBus> rtu_;
};

}  // namespace gonio::contracts
