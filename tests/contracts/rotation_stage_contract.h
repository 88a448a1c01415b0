#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <functional>
#include <future>
#include <limits>
#include <memory>
#include <ostream>
#include <string>
#include <thread>

#include "gonio/devices/rotation_stage.h"
#include "throws_device_error.h"

/// What every RotationStage has to do. A test program names the stages it has with
/// INSTANTIATE_TEST_SUITE_P(name, RotationStageContract, testing::Values(...)).
namespace gonio::contracts {

/// A stage as after power-up, and what its maker promises about it.
struct StageUnderTest {
  std::shared_ptr<devices::RotationStage> stage;  ///< not homed; keeps its world alive
  Angle home;                                     ///< joint angle of the home mark
  Angle resolution;             ///< how close a reported angle comes to its target
  bool just_powered_up = true;  ///< false: it may know its home from before
  /// Cuts the link to the stage, or brings it back; none where there is no link to lose.
  std::function<void(bool connected)> set_link = {};
};

struct StageMaker {
  std::string name;
  std::function<StageUnderTest()> make;

  friend std::ostream& operator<<(std::ostream& out, const StageMaker& maker) {
    return out << maker.name;
  }
};

class RotationStageContract : public testing::TestWithParam<StageMaker> {
 protected:
  static constexpr std::chrono::milliseconds kPatience{300000};
  // Of the host's time, whatever the stage's clock: a stop, and an error that a lost link ends
  // with.
  static constexpr std::chrono::seconds kStopDeadline{1};
  static constexpr std::chrono::seconds kLinkDeadline{10};

  RotationStageContract() : made_(GetParam().make()), stage_(*made_.stage) {}

  Angle at_share(double share) const {
    const devices::JointLimits limits = stage_.limits();
    return limits.min + share * (limits.max - limits.min);
  }

  Angle go_to(Angle target) {
    stage_.begin_move_to(target);
    return stage_.wait_until_settled(kPatience);
  }

  void expect_near(Angle angle, Angle target) const {
    EXPECT_NEAR(angle.degrees(), target.degrees(), made_.resolution.degrees());
  }

  StageUnderTest made_;
  devices::RotationStage& stage_;
};

TEST_P(RotationStageContract, HasANameAndAnOrderedRange) {
  EXPECT_FALSE(stage_.name().empty());
  EXPECT_LT(stage_.limits().min, stage_.limits().max);
  EXPECT_GE(made_.home, stage_.limits().min);
  EXPECT_LE(made_.home, stage_.limits().max);
}

TEST_P(RotationStageContract, RefusesToMoveBeforeHoming) {
  if (!made_.just_powered_up) GTEST_SKIP() << "no test can switch this stage off and on";
  EXPECT_THAT([&] { stage_.begin_move_to(at_share(0.5)); },
              ThrowsDeviceError(devices::DeviceErrc::NotHomed));
}

TEST_P(RotationStageContract, KnowsNoAngleBeforeHoming) {
  if (!made_.just_powered_up) GTEST_SKIP() << "no test can switch this stage off and on";
  EXPECT_THAT([&] { stage_.wait_until_settled(kPatience); },
              ThrowsDeviceError(devices::DeviceErrc::NotHomed));
}

TEST_P(RotationStageContract, StandsAtItsHomeAngleAfterHoming) {
  stage_.home(kPatience);
  expect_near(stage_.wait_until_settled(kPatience), made_.home);
}

TEST_P(RotationStageContract, HomesAgainFromAnywhere) {
  stage_.home(kPatience);
  go_to(at_share(0.9));
  stage_.home(kPatience);
  expect_near(stage_.wait_until_settled(kPatience), made_.home);
}

TEST_P(RotationStageContract, FailedHomingLeavesItNotHomed) {
  stage_.home(kPatience);
  go_to(at_share(0.9));
  EXPECT_THAT([&] { stage_.home(std::chrono::milliseconds(1)); },
              ThrowsDeviceError(devices::DeviceErrc::Timeout));
  EXPECT_THAT([&] { stage_.begin_move_to(at_share(0.5)); },
              ThrowsDeviceError(devices::DeviceErrc::NotHomed));
  stage_.home(kPatience);
  expect_near(go_to(at_share(0.5)), at_share(0.5));
}

TEST_P(RotationStageContract, ReportsTheAngleItReached) {
  stage_.home(kPatience);
  for (const double share : {0.3, 0.7, 0.1, 0.5}) {
    expect_near(go_to(at_share(share)), at_share(share));
  }
}

TEST_P(RotationStageContract, ReachesBothLimits) {
  stage_.home(kPatience);
  expect_near(go_to(stage_.limits().min), stage_.limits().min);
  expect_near(go_to(stage_.limits().max), stage_.limits().max);
}

TEST_P(RotationStageContract, RefusesATargetBeyondItsLimitsWithoutMoving) {
  stage_.home(kPatience);
  const Angle before = go_to(at_share(0.5));
  const Angle beyond = Angle::from_degrees(0.1);
  const Angle targets[] = {stage_.limits().max + beyond, stage_.limits().min - beyond,
                           Angle::from_radians(std::numeric_limits<double>::quiet_NaN()),
                           Angle::from_radians(std::numeric_limits<double>::infinity())};
  for (const Angle target : targets) {
    EXPECT_THAT([&] { stage_.begin_move_to(target); },
                ThrowsDeviceError(devices::DeviceErrc::LimitViolation));
    EXPECT_EQ(stage_.wait_until_settled(kPatience), before);
  }
}

TEST_P(RotationStageContract, RefusedTargetLeavesTheMoveUnderWay) {
  stage_.home(kPatience);
  stage_.begin_move_to(at_share(0.8));
  EXPECT_THAT([&] { stage_.begin_move_to(stage_.limits().max + Angle::from_degrees(1.0)); },
              ThrowsDeviceError(devices::DeviceErrc::LimitViolation));
  expect_near(stage_.wait_until_settled(kPatience), at_share(0.8));
}

TEST_P(RotationStageContract, TimeoutLeavesTheMoveRunning) {
  stage_.home(kPatience);
  go_to(at_share(0.1));
  stage_.begin_move_to(at_share(0.9));
  EXPECT_THAT([&] { stage_.wait_until_settled(std::chrono::milliseconds(1)); },
              ThrowsDeviceError(devices::DeviceErrc::Timeout));
  expect_near(stage_.wait_until_settled(kPatience), at_share(0.9));
}

TEST_P(RotationStageContract, WaitingWithoutAMoveReturnsThePresentAngle) {
  stage_.home(kPatience);
  const Angle reached = go_to(at_share(0.6));
  EXPECT_EQ(stage_.wait_until_settled(kPatience), reached);
}

TEST_P(RotationStageContract, NewTargetReplacesAMoveUnderWay) {
  stage_.home(kPatience);
  go_to(at_share(0.2));
  stage_.begin_move_to(at_share(0.9));
  stage_.begin_move_to(at_share(0.4));
  expect_near(stage_.wait_until_settled(kPatience), at_share(0.4));
}

TEST_P(RotationStageContract, StopLatchesUntilRearmed) {
  stage_.home(kPatience);
  stage_.stop();
  EXPECT_THAT([&] { stage_.begin_move_to(at_share(0.5)); },
              ThrowsDeviceError(devices::DeviceErrc::Stopped));
  EXPECT_THAT([&] { stage_.wait_until_settled(kPatience); },
              ThrowsDeviceError(devices::DeviceErrc::Stopped));
  EXPECT_THAT([&] { stage_.home(kPatience); }, ThrowsDeviceError(devices::DeviceErrc::Stopped));
  stage_.rearm();
  expect_near(go_to(at_share(0.5)), at_share(0.5));
}

TEST_P(RotationStageContract, StopEndsAMoveShortOfItsTargetAndKeepsItHomed) {
  stage_.home(kPatience);
  go_to(at_share(0.1));
  stage_.begin_move_to(at_share(0.9));
  stage_.stop();
  stage_.rearm();
  const Angle stood = stage_.wait_until_settled(kPatience);
  EXPECT_LT(stood, at_share(0.85));
  EXPECT_GE(stood, at_share(0.1) - made_.resolution);
  expect_near(go_to(at_share(0.9)), at_share(0.9));
}

TEST_P(RotationStageContract, StopWorksFromAnotherThread) {
  stage_.home(kPatience);
  stage_.begin_move_to(at_share(0.9));
  std::thread([&] { stage_.stop(); }).join();
  EXPECT_THAT([&] { stage_.wait_until_settled(kPatience); },
              ThrowsDeviceError(devices::DeviceErrc::Stopped));
}

TEST_P(RotationStageContract, StopIsDoneSoonAndEndsAWaitOnAnotherThread) {
  stage_.home(kPatience);
  go_to(at_share(0.1));
  stage_.begin_move_to(at_share(0.9));
  auto waiting =
      std::async(std::launch::async, [&] { return stage_.wait_until_settled(kPatience); });
  const auto begun = std::chrono::steady_clock::now();
  stage_.stop();
  EXPECT_LT(std::chrono::steady_clock::now() - begun, kStopDeadline);
  ASSERT_EQ(waiting.wait_for(kStopDeadline), std::future_status::ready);
  try {
    expect_near(waiting.get(), at_share(0.9));  // on virtual time it may have been there before
  } catch (const devices::DeviceError& error) {
    EXPECT_EQ(error.code(), devices::DeviceErrc::Stopped);
  }
  EXPECT_THAT([&] { stage_.begin_move_to(at_share(0.5)); },
              ThrowsDeviceError(devices::DeviceErrc::Stopped));
}

TEST_P(RotationStageContract, LostLinkIsAnErrorUntilItIsBackAndTheAxisHomed) {
  if (!made_.set_link) GTEST_SKIP() << "this stage has no link to lose";
  stage_.home(kPatience);
  go_to(at_share(0.3));
  made_.set_link(false);
  const auto begun = std::chrono::steady_clock::now();
  const auto gone = testing::AnyOf(devices::DeviceErrc::Disconnected, devices::DeviceErrc::Timeout);
  EXPECT_THAT([&] { stage_.wait_until_settled(kPatience); },
              testing::Throws<devices::DeviceError>(
                  testing::Property("code", &devices::DeviceError::code, gone)));
  EXPECT_THAT([&] { stage_.home(kPatience); },
              testing::Throws<devices::DeviceError>(
                  testing::Property("code", &devices::DeviceError::code, gone)));
  EXPECT_LT(std::chrono::steady_clock::now() - begun, kLinkDeadline);
  made_.set_link(true);
  EXPECT_THAT([&] { stage_.begin_move_to(at_share(0.5)); },
              ThrowsDeviceError(devices::DeviceErrc::NotHomed));
  stage_.home(kPatience);
  expect_near(go_to(at_share(0.5)), at_share(0.5));
}

TEST_P(RotationStageContract, StopWorksBeforeHomingAndTwice) {
  stage_.stop();
  stage_.stop();
  EXPECT_THAT([&] { stage_.home(kPatience); }, ThrowsDeviceError(devices::DeviceErrc::Stopped));
  stage_.rearm();
  stage_.home(kPatience);
  expect_near(stage_.wait_until_settled(kPatience), made_.home);
}

TEST_P(RotationStageContract, RearmWithoutStopChangesNothing) {
  stage_.home(kPatience);
  stage_.begin_move_to(at_share(0.7));
  stage_.rearm();
  expect_near(stage_.wait_until_settled(kPatience), at_share(0.7));
}

TEST_P(RotationStageContract, ErrorsNameTheStage) {
  try {
    stage_.begin_move_to(stage_.limits().max + Angle::from_degrees(1.0));
    FAIL() << "moved beyond its limits";
  } catch (const devices::DeviceError& error) {
    EXPECT_EQ(error.device(), stage_.name());
  }
}

}  // namespace gonio::contracts
