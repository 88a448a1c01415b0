#include "gonio/acquisition/guarded_devices.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "fake_rig.h"

namespace gonio::acquisition {
namespace {

using namespace gonio::literals;

constexpr std::size_t kArm = 0;
constexpr std::size_t kTilt = 2;

class GuardedDevicesTest : public testing::Test {
 protected:
  GuardedDevicesTest() {
    for (auto& stage : rig_.stages) {
      stage->moved = [this](const FakeStage& moved, Angle target) {
        moves_.emplace_back(moved.name(), std::lround(target.degrees()));
      };
    }
  }
  GuardedDevices& devices() {
    if (!devices_) {
      devices_.emplace(
          set_, rig_.known.rig, options_,
          [this](std::chrono::nanoseconds, const std::string& kind, const std::string&) {
            notes_.push_back(kind);
          },
          std::stop_token());
      devices_->home_all();
    }
    return *devices_;
  }

  FakeRig rig_;
  DeviceSet set_ = rig_.devices();
  SessionOptions options_;
  std::vector<std::string> notes_;
  std::vector<std::pair<std::string, long>> moves_;  ///< of every stage in order, whole degrees
  std::optional<GuardedDevices> devices_;
};

TEST_F(GuardedDevicesTest, AnAxisEndsItsApproachBeforeTheNextMovesWhereTheyMoveInTurn) {
  // With the arm still 2 deg too low when the tilt comes, the sample would be inside this.
  rig_.known.rig.keep_outs = {{"post", {{kArm, 60_deg, 80_deg}, {kTilt, 30_deg, 90_deg}}}};
  rig_.known.rig.axes[kArm].approach_overshoot = 2_deg;
  rig_.known.rig.simultaneous_axes = false;
  devices().move_to({100_deg, 0_deg, 10_deg});
  moves_.clear();
  devices().move_to({81_deg, 0_deg, 40_deg});
  const std::vector<std::pair<std::string, long>> in_turn{
      {"lamp_arm", 79}, {"lamp_arm", 81}, {"azimuth", 0}, {"tilt", 40}};
  EXPECT_EQ(moves_, in_turn);
}

TEST_F(GuardedDevicesTest, AxesGoBelowTheirTargetsTogetherWhereTheyMoveTogether) {
  rig_.known.rig.axes[kArm].approach_overshoot = 2_deg;
  devices().move_to({81_deg, 0_deg, 40_deg});
  const std::vector<std::pair<std::string, long>> together{{"lamp_arm", 79}, {"azimuth", 0},
                                                           {"tilt", 40},     {"lamp_arm", 81},
                                                           {"azimuth", 0},   {"tilt", 40}};
  EXPECT_EQ(moves_, together);
}

TEST_F(GuardedDevicesTest, AnAxisThatWasHomedIsApproachedEvenWhereItStands) {
  // A home mark is met from any side: without an approach the axis is off by its play there.
  rig_.known.rig.axes[kTilt].approach_overshoot = 2_deg;
  const auto tilts = [&](auto act) {
    moves_.clear();
    act();
    std::vector<long> targets;
    for (const auto& [axis, target] : moves_) {
      if (axis == "tilt") targets.push_back(target);
    }
    return targets;
  };
  using testing::ElementsAre;
  const auto go = [&](Angle tilt) { devices().move_to({100_deg, 0_deg, tilt}); };
  EXPECT_THAT(tilts([&] { go(0_deg); }), ElementsAre(-2, 0));
  EXPECT_THAT(tilts([&] { go(0_deg); }), ElementsAre(0));
  devices().home(kTilt);
  EXPECT_THAT(tilts([&] { go(1_deg); }), ElementsAre(-1, 1)) << "less than the approach";
  devices().home(kTilt);
  EXPECT_THAT(tilts([&] { go(3_deg); }), ElementsAre(3)) << "rises by more than the approach";
  devices().stand_still();
  EXPECT_THAT(tilts([&] { go(3_deg); }), ElementsAre(1, 3)) << "stopped on the way, say";
}

TEST_F(GuardedDevicesTest, WhatTheEncodersSayMakesNoMoveThatWasNotChecked) {
  // Arm first, then the tilt. An arm that reads a little high must not go below its target again
  // once the sample is tilted, nor be refused the way.
  rig_.known.rig.keep_outs = {{"post", {{kArm, 60_deg, 80_deg}, {kTilt, 30_deg, 90_deg}}}};
  rig_.known.rig.axes[kArm].approach_overshoot = 2_deg;
  for (auto& stage : rig_.stages) stage->reading_error = 0.001_deg;
  devices().move_to({100_deg, 0_deg, 10_deg});
  moves_.clear();
  devices().move_to({81_deg, 0_deg, 40_deg});
  const std::vector<std::pair<std::string, long>> arm_first{
      {"lamp_arm", 79}, {"azimuth", 0},   {"tilt", 10},   {"lamp_arm", 81}, {"azimuth", 0},
      {"tilt", 10},     {"lamp_arm", 81}, {"azimuth", 0}, {"tilt", 40}};
  EXPECT_EQ(moves_, arm_first);
  devices().move_to({81_deg, 0_deg, 45_deg});
}

TEST_F(GuardedDevicesTest, SaysWhichAxisDidNotArrive) {
  devices();
  rig_.stages[kTilt]->reading_error = 0.2_deg;
  try {
    devices().move_to({81_deg, 0_deg, 40_deg});
    FAIL() << "an axis 0.2 deg astray went through";
  } catch (const devices::DeviceError& error) {
    EXPECT_EQ(error.code(), devices::DeviceErrc::Timeout);
    EXPECT_EQ(error.device(), "tilt");
  }
}

TEST_F(GuardedDevicesTest, StandsArmedWhereTheEncodersSayAfterAMoveThatFailed) {
  options_.retries = 0;
  devices();
  rig_.stages[kTilt]->on_move = [](FakeStage& stage) {
    throw devices::DeviceError(devices::DeviceErrc::Timeout, stage.name(), "did not arrive");
  };
  EXPECT_THROW(devices().move_to({81_deg, 0_deg, 40_deg}), devices::DeviceError);
  EXPECT_EQ(devices().joints(), (rig::Joints{81_deg, 0_deg, 0_deg}));
  rig_.stages[kTilt]->on_move = nullptr;
  EXPECT_EQ(devices().move_to({85_deg, 0_deg, 40_deg}), (rig::Joints{85_deg, 0_deg, 40_deg}));
}

TEST_F(GuardedDevicesTest, CannotGoOnFromWhereItDoesNotKnowItStands) {
  options_.retries = 0;
  devices();
  rig_.stages[kTilt]->on_move = [this](FakeStage& stage) {
    rig_.stages[kArm]->on_settle = [] {
      throw devices::DeviceError(devices::DeviceErrc::Timeout, "lamp_arm", "no answer");
    };
    throw devices::DeviceError(devices::DeviceErrc::Timeout, stage.name(), "did not arrive");
  };
  try {
    devices().move_to({81_deg, 0_deg, 40_deg});
    FAIL() << "the move went well";
  } catch (const devices::DeviceError& error) {
    EXPECT_EQ(error.code(), devices::DeviceErrc::Fault) << error.what();
  }
  for (const auto& stage : rig_.stages) EXPECT_TRUE(stage->stopped) << stage->name();
}

TEST_F(GuardedDevicesTest, AnAxisThatDoesNotFindItsMarkIsNotDrivenAgain) {
  for (const auto code : {devices::DeviceErrc::Timeout, devices::DeviceErrc::Fault}) {
    FakeStage& arm = *rig_.stages[kArm];
    arm.homing_attempts = 0;
    arm.on_home = [&](FakeStage& stage) {
      throw devices::DeviceError(code, stage.name(), "no mark found");
    };
    devices_.reset();
    EXPECT_THROW(devices(), devices::DeviceError);
    EXPECT_EQ(arm.homing_attempts, 1);
  }
}

TEST_F(GuardedDevicesTest, ABrokenAnswerDoesNotEndAHoming) {
  FakeStage& arm = *rig_.stages[kArm];
  arm.on_home = [](FakeStage& stage) {
    if (stage.homing_attempts == 1) {
      throw devices::DeviceError(devices::DeviceErrc::Protocol, stage.name(), "checksum");
    }
  };
  devices();
  EXPECT_EQ(arm.homings, 1);
}

TEST_F(GuardedDevicesTest, TakesOverAxesThatKnowWhereTheyAreWithoutHoming) {
  for (auto& stage : rig_.stages) stage->home(std::chrono::seconds(1));
  moves_.clear();
  GuardedDevices guarded(set_, rig_.known.rig, options_, {}, std::stop_token());
  guarded.take_over();
  EXPECT_TRUE(moves_.empty());
  EXPECT_EQ(guarded.joints(), rig_.known.rig.home());
  guarded.move_to({100_deg, 10_deg, 20_deg});
  EXPECT_EQ(guarded.joints(), (rig::Joints{100_deg, 10_deg, 20_deg}));
}

TEST_F(GuardedDevicesTest, TakesNothingOverThatIsNotHomed) {
  GuardedDevices guarded(set_, rig_.known.rig, options_, {}, std::stop_token());
  EXPECT_THROW(guarded.take_over(), devices::DeviceError);
}

}  // namespace
}  // namespace gonio::acquisition
