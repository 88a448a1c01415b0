// The rules that every stage shares, without a stage.

#include "gonio/devices/stage_gate.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "../contracts/throws_device_error.h"

namespace gonio::devices {
namespace {

using contracts::ThrowsDeviceError;
using namespace gonio::literals;

class StageGateTest : public testing::Test {
 protected:
  StageGateTest() { gate_.set_homed(true); }
  void stop() { const auto hold = gate_.hold_for_stop(); }

  StageGate gate_{"tilt", {-90.0_deg, 90.0_deg}};
};

TEST_F(StageGateTest, StopLatchesUntilItIsRearmed) {
  stop();
  EXPECT_TRUE(gate_.latched());
  EXPECT_THAT([&] { gate_.hold_for_move(0.0_deg); }, ThrowsDeviceError(DeviceErrc::Stopped));
  EXPECT_THAT([&] { gate_.hold_for_homing(); }, ThrowsDeviceError(DeviceErrc::Stopped));
  gate_.rearm(gate_.stops());
  EXPECT_FALSE(gate_.latched());
  EXPECT_NO_THROW(gate_.hold_for_move(0.0_deg));
}

TEST_F(StageGateTest, StopSinceTheOneThatWasLookedAfterStaysLatched) {
  stop();
  const std::uint64_t seen = gate_.stops();
  stop();  // another thread's, between the look at the axis and its release
  EXPECT_THAT([&] { gate_.rearm(seen); }, ThrowsDeviceError(DeviceErrc::Stopped));
  EXPECT_TRUE(gate_.latched());
  EXPECT_THAT([&] { gate_.hold_for_move(0.0_deg); }, ThrowsDeviceError(DeviceErrc::Stopped));
  gate_.rearm(gate_.stops());
  EXPECT_FALSE(gate_.latched());
}

TEST_F(StageGateTest, RefusesInTheOrderStoppedNotHomedLimits) {
  gate_.set_homed(false);
  EXPECT_THAT([&] { gate_.hold_for_move(91.0_deg); }, ThrowsDeviceError(DeviceErrc::NotHomed));
  stop();
  EXPECT_THAT([&] { gate_.hold_for_move(91.0_deg); }, ThrowsDeviceError(DeviceErrc::Stopped));
  gate_.rearm(gate_.stops());
  gate_.set_homed(true);
  EXPECT_THAT([&] { gate_.hold_for_move(91.0_deg); },
              ThrowsDeviceError(DeviceErrc::LimitViolation));
}

}  // namespace
}  // namespace gonio::devices
