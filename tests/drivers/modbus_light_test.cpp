#include "gonio/modbus_light/modbus_light.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>

#include "fake_modbus_bus.h"
#include "gonio/devices/steady_clock.h"

namespace gonio::modbus_light {
namespace {

using devices::DeviceErrc;
using devices::DeviceError;
using modbus_bus::FakeBus;
using modbus_bus::Function;
using modbus_bus::Request;
using namespace std::chrono_literals;
using testing::HasSubstr;

LampProfile two_channels() {
  LampProfile profile;
  profile.shutter_coil = 7;
  profile.channel_register = 100;
  profile.channels = {{"R", 630.0, 1, 101, 800}, {"G", 530.0, 2, 102, 500}};
  profile.steady_time = 50ms;
  profile.temperature_register = 3;
  return profile;
}

DeviceErrc code_of(const std::function<void()>& action) {
  try {
    action();
  } catch (const DeviceError& error) {
    return error.code();
  }
  ADD_FAILURE() << "nothing was thrown";
  return DeviceErrc::Protocol;
}

class ModbusLightTest : public testing::Test {
 protected:
  std::unique_ptr<ModbusLight> make(LampProfile profile = two_channels()) {
    return std::make_unique<ModbusLight>(bus_, 1, "lamp", std::move(profile), clock_);
  }

  std::shared_ptr<FakeBus> bus_ = std::make_shared<FakeBus>();
  devices::SteadyClock clock_{100.0};
};

TEST_F(ModbusLightTest, IsConstructedDark) {
  bus_->coils[7] = 1;
  make();
  EXPECT_EQ(bus_->coils[7], 0);
}

TEST_F(ModbusLightTest, SetsLevelAndChannelBeforeItOpens) {
  const auto light = make();
  bus_->writes.clear();
  light->light("G");
  ASSERT_EQ(bus_->writes.size(), 3U);
  EXPECT_EQ(bus_->writes[0].request, modbus_bus::write_register(102, 500));
  EXPECT_EQ(bus_->writes[1].request, modbus_bus::write_register(100, 2));
  EXPECT_EQ(bus_->writes[2].request, modbus_bus::write_coil(7, true));
}

TEST_F(ModbusLightTest, WaitsUntilTheLightIsSteadyAfterAChangeOnly) {
  const auto light = make();
  const auto time_to_light = [&](const char* channel) {
    const auto before = clock_.now();
    light->light(channel);
    return clock_.now() - before;
  };
  EXPECT_GE(time_to_light("G"), 50ms);
  EXPECT_LT(time_to_light("G"), 50ms);
  EXPECT_GE(time_to_light("R"), 50ms);
  light->close_shutter();
  EXPECT_GE(time_to_light("R"), 50ms);
}

TEST_F(ModbusLightTest, ClosingIsUrgentAndReadBack) {
  const auto light = make();
  light->light("R");
  bus_->writes.clear();
  bool read_back = false;
  bus_->on_read = [&](const Request& request) {
    read_back = request.function == Function::read_coils && request.address == 7;
  };
  light->close_shutter();
  ASSERT_EQ(bus_->writes.size(), 1U);
  EXPECT_TRUE(bus_->writes[0].urgent);
  EXPECT_TRUE(read_back);
}

TEST_F(ModbusLightTest, ShutterThatStaysOpenIsAFaultOfWhateverComesNext) {
  const auto light = make();
  light->light("R");
  bus_->on_write = [this](const Request&) { bus_->coils[7] = 1; };  // jammed
  light->close_shutter();
  EXPECT_EQ(code_of([&] { light->light("R"); }), DeviceErrc::Fault);
  EXPECT_EQ(code_of([&] { light->temperature_c(); }), DeviceErrc::Fault);
  bus_->on_write = nullptr;
  EXPECT_NO_THROW(light->temperature_c());
  EXPECT_EQ(bus_->coils[7], 0);
}

TEST_F(ModbusLightTest, ShutterThatStaysClosedIsAFault) {
  const auto light = make();
  bus_->on_write = [this](const Request&) { bus_->coils[7] = 0; };
  EXPECT_EQ(code_of([&] { light->light("R"); }), DeviceErrc::Fault);
}

TEST_F(ModbusLightTest, FailedLightingLeavesTheShutterClosed) {
  const auto light = make();
  bool opened = false;
  bus_->on_write = [&](const Request& request) {  // its state cannot be read once it is open
    if (request.address != 7) return;
    opened = opened || request.words[0] == 1;
    if (request.words[0] == 1) {
      bus_->fails = DeviceErrc::Timeout;
    } else {
      bus_->fails.reset();
    }
  };
  bus_->fails_only = [](const Request& request) { return request.reads(); };
  EXPECT_EQ(code_of([&] { light->light("R"); }), DeviceErrc::Timeout);
  EXPECT_TRUE(opened);
  EXPECT_EQ(bus_->coils[7], 0);
  EXPECT_TRUE(bus_->writes.back().urgent);
  bus_->on_write = nullptr;
  light->light("R");  // and the next channel of a lit lamp, too
  bus_->fails = DeviceErrc::Fault;
  bus_->fails_only = [](const Request& request) { return request.address == 102; };
  EXPECT_EQ(code_of([&] { light->light("G"); }), DeviceErrc::Fault);
  EXPECT_EQ(bus_->coils[7], 0);
}

TEST_F(ModbusLightTest, ClosesWhenItIsDestroyedLit) {
  auto light = make();
  light->light("R");
  light.reset();
  EXPECT_EQ(bus_->coils[7], 0);
  light = make();
  light->light("R");
  bus_->fails = DeviceErrc::Timeout;
  EXPECT_NO_THROW(light.reset());
}

TEST_F(ModbusLightTest, RequireClosedTriesAgainAndSaysWhy) {
  const auto light = make();
  light->light("R");
  bus_->writes.clear();
  bus_->fails = DeviceErrc::Timeout;
  light->close_shutter();
  EXPECT_EQ(code_of([&] { light->require_closed(); }), DeviceErrc::Timeout);
  bus_->fails.reset();
  bus_->on_write = [this](const Request&) { bus_->coils[7] = 1; };  // jammed
  EXPECT_EQ(code_of([&] { light->require_closed(); }), DeviceErrc::Fault);
  EXPECT_EQ(bus_->writes.back().attempts, modbus_bus::Attempts::several);
  light->close_shutter();
  EXPECT_EQ(bus_->writes.back().attempts, modbus_bus::Attempts::one);
  bus_->on_write = nullptr;
  EXPECT_NO_THROW(light->require_closed());
  EXPECT_EQ(bus_->coils[7], 0);
}

TEST_F(ModbusLightTest, ClosingDuringLightingWins) {
  const auto light = make();
  bool closed = false;
  bus_->on_write = [&](const Request& request) {
    if (request.address != 100 || closed) return;
    closed = true;
    light->close_shutter();  // as another thread would between two requests
  };
  EXPECT_EQ(code_of([&] { light->light("R"); }), DeviceErrc::Stopped);
  EXPECT_EQ(bus_->coils[7], 0);
}

TEST_F(ModbusLightTest, ReadsTheTemperatureWithItsSign) {
  const auto light = make();
  bus_->registers[3] = static_cast<std::uint16_t>(-52);
  EXPECT_NEAR(light->temperature_c(), -5.2, 1e-12);
  LampProfile profile = two_channels();
  profile.temperature_register.reset();
  EXPECT_EQ(code_of([&] { make(profile)->temperature_c(); }), DeviceErrc::Fault);
}

TEST_F(ModbusLightTest, RefusesProfilesNamingTheField) {
  const std::pair<std::function<void(LampProfile&)>, const char*> kCases[] = {
      {[](auto& p) { p.channels.clear(); }, "channels: found none"},
      {[](auto& p) { p.channels[1].name = "R"; }, "found the name \"R\""},
      {[](auto& p) { p.channels[0].name.clear(); }, "found the name \"\""},
      {[](auto& p) { p.channels[0].wavelength_nm = -1.0; }, "wavelength_nm"},
      {[](auto& p) { p.channels[1].level_register = 100; }, "channel G: level_register: found 100"},
      {[](auto& p) { p.steady_time = -1ms; }, "steady_ms"},
      {[](auto& p) { p.temperature_scale = std::numeric_limits<double>::infinity(); },
       "temperature_scale"}};
  for (const auto& [spoil, expected] : kCases) {
    LampProfile profile = two_channels();
    spoil(profile);
    EXPECT_THAT([&] { make(profile); },
                testing::ThrowsMessage<std::invalid_argument>(HasSubstr(expected)));
  }
}

}  // namespace
}  // namespace gonio::modbus_light
