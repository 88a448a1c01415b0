#include "gonio/modbus_changer/modbus_changer.h"

#include <gmock/gmock.h>

#include <functional>
#include <memory>
#include <utility>

#include "fake_modbus_bus.h"
#include "gonio/devices/steady_clock.h"

namespace gonio::modbus_changer {
namespace {

using devices::DeviceErrc;
using devices::DeviceError;
using devices::Target;
using modbus_bus::FakeBus;
using modbus_bus::Request;
using namespace std::chrono_literals;
using testing::HasSubstr;

constexpr std::uint16_t kCommand = 10;
constexpr std::uint16_t kStatus = 20;

ChangerProfile three_places() {
  ChangerProfile profile;
  profile.command_register = kCommand;
  profile.status_register = kStatus;
  profile.places = {{Target::sample, 1}, {Target::white, 2}, {Target::mirror, 5}};
  profile.timeout = 60s;
  return profile;
}

std::string error_of(const std::function<void()>& action, DeviceErrc code) {
  try {
    action();
  } catch (const DeviceError& error) {
    EXPECT_EQ(error.code(), code) << error.what();
    return error.what();
  }
  ADD_FAILURE() << "nothing was thrown";
  return {};
}

class ModbusChangerTest : public testing::Test {
 protected:
  ModbusChangerTest() { bus_->registers[kStatus] = 1; }

  std::unique_ptr<ModbusChanger> make(ChangerProfile profile = three_places()) {
    return std::make_unique<ModbusChanger>(bus_, 1, "changer", std::move(profile), clock_);
  }

  /// From the next command on it says 0 for `polls` answers, then `arrives`.
  void moves(int polls, std::uint16_t arrives) {
    bus_->on_write = [this, polls, arrives](const Request&) {
      bus_->registers[kStatus] = 0;
      bus_->on_read = [this, left = polls, arrives](const Request&) mutable {
        if (left-- == 0) bus_->registers[kStatus] = arrives;
      };
    };
  }

  std::shared_ptr<FakeBus> bus_ = std::make_shared<FakeBus>();
  devices::SteadyClock clock_{1000.0};
};

TEST_F(ModbusChangerTest, IsOpenedWithoutAMotionAndSaysWhatLiesThere) {
  bus_->registers[kStatus] = 5;
  EXPECT_EQ(make()->mounted(), Target::mirror);
  EXPECT_TRUE(bus_->writes.empty());
}

TEST_F(ModbusChangerTest, SendsThePlaceAndWaitsUntilItStandsThere) {
  const auto changer = make();
  moves(3, 5);
  changer->mount(Target::mirror);
  ASSERT_EQ(bus_->writes.size(), 1U);
  EXPECT_EQ(bus_->writes[0].request, modbus_bus::write_register(kCommand, 5));
  EXPECT_EQ(bus_->registers[kStatus], 5);
  EXPECT_EQ(changer->mounted(), Target::mirror);
  changer->mount(Target::mirror);
  EXPECT_EQ(bus_->writes.size(), 1U);
}

TEST_F(ModbusChangerTest, TargetThatItDoesNotCarryMovesNothing) {
  const auto changer = make();
  EXPECT_THAT(error_of([&] { changer->mount(Target::black_trap); }, DeviceErrc::Fault),
              HasSubstr("carries no black trap, only sample, white, mirror"));
  EXPECT_TRUE(bus_->writes.empty());
  EXPECT_EQ(changer->mounted(), Target::sample);
}

TEST_F(ModbusChangerTest, OneThatDoesNotStartIsAFault) {
  const auto changer = make();
  EXPECT_THAT(error_of([&] { changer->mount(Target::white); }, DeviceErrc::Fault),
              HasSubstr("stands at place 1 instead of 2"));
  EXPECT_EQ(changer->mounted(), Target::sample);
}

TEST_F(ModbusChangerTest, OneThatArrivesElsewhereIsAFaultAndItsPlaceIsAskedAnew) {
  const auto changer = make();
  moves(2, 5);
  EXPECT_THAT(error_of([&] { changer->mount(Target::white); }, DeviceErrc::Fault),
              HasSubstr("stands at place 5 instead of 2"));
  EXPECT_EQ(changer->mounted(), Target::mirror);
}

TEST_F(ModbusChangerTest, OneThatNeverArrivesIsATimeoutAndStandsNowhere) {
  const auto changer = make();
  bus_->on_write = [this](const Request&) { bus_->registers[kStatus] = 0; };
  const auto before = clock_.now();
  EXPECT_THAT(error_of([&] { changer->mount(Target::white); }, DeviceErrc::Timeout),
              HasSubstr("not at place 2 within 60 s"));
  EXPECT_GE(clock_.now() - before, 60s);
  EXPECT_THAT(error_of([&] { changer->mounted(); }, DeviceErrc::Fault),
              HasSubstr("between two places"));
  bus_->registers[kStatus] = 9;
  EXPECT_THAT(error_of([&] { changer->mounted(); }, DeviceErrc::Fault),
              HasSubstr("place 9, at which the rig file has no target"));
}

TEST_F(ModbusChangerTest, LinkThatIsLostIsTold) {
  const auto changer = make();
  bus_->fails = DeviceErrc::Disconnected;
  error_of([&] { changer->mount(Target::white); }, DeviceErrc::Disconnected);
  error_of([&] { changer->mounted(); }, DeviceErrc::Disconnected);
}

TEST_F(ModbusChangerTest, RefusesAProfileThatCannotBe) {
  const auto refused = [&](const std::function<void(ChangerProfile&)>& damage, const char* why) {
    ChangerProfile profile = three_places();
    damage(profile);
    EXPECT_THAT([&] { make(profile); },
                testing::ThrowsMessage<std::invalid_argument>(HasSubstr(why)));
  };
  refused([](ChangerProfile& p) { p.places.clear(); }, "place: found none");
  refused([](ChangerProfile& p) { p.places[1].target = Target::sample; }, "\"sample\" twice");
  refused([](ChangerProfile& p) { p.places[1].number = 5; }, "a number of its own");
  refused([](ChangerProfile& p) { p.places[1].number = 0; }, "found 0");
  refused([](ChangerProfile& p) { p.timeout = 0s; }, "timeout: found 0 ms");
}

}  // namespace
}  // namespace gonio::modbus_changer
