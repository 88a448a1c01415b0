// What happened to the lamp while a session was interrupted.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "steady_session.h"

namespace gonio {
namespace {

using acquisition::Reduction;

class ResumeBridge : public SteadySession {
 protected:
  void SetUp() override {
    options_.white_frames = 4;
    begin(folder_ / "whole");
  }

  /// The session, stopped after six points and gone on with under a lamp that is brighter by this.
  /// The monitor does not see it.
  Reduction resumed_under(double brighter) {
    const std::filesystem::path session = folder_ / "session";
    interrupt_and_resume(session, [&] { world_.camera.responsivity_e_per_s *= 1.0 + brighter; });
    return reduced(session);
  }

  TemporaryFolder folder_;
};

TEST_F(ResumeBridge, AStepOfTheLampIsBridgedAndTold) {
  const Reduction resumed = resumed_under(0.03);
  ASSERT_EQ(resumed.bridges.size(), 1U);
  const acquisition::WhiteBridge& bridge = resumed.bridges.front();
  RecordProperty("change", std::to_string(bridge.change_relative));
  RecordProperty("u", std::to_string(bridge.u_relative));
  EXPECT_TRUE(bridge.is_applied());
  EXPECT_NEAR(bridge.change_relative, 0.03, 3.0 * bridge.u_relative);
  EXPECT_LT(bridge.u_relative, 0.005);
  EXPECT_THAT(resumed.warnings, testing::Contains(testing::HasSubstr("after an interruption")));
  const double worst = worst_deviation(resumed, folder_ / "whole");
  RecordProperty("worst_deviation", std::to_string(worst));
  EXPECT_LT(worst, 0.005);
  // Nobody knows when it happened: the points before may have seen some of it.
  constexpr double kOfAStep = 0.03 / 3.4641;
  for (const samples::Sample& sample : resumed.samples.samples) {
    EXPECT_GT(sample.u_common_per_sr[0], 0.9 * kOfAStep * sample.value_per_sr[0]);
  }
}

TEST_F(ResumeBridge, WhatNoiseExplainsIsNotBridged) {
  const Reduction resumed = resumed_under(0.0005);
  ASSERT_EQ(resumed.bridges.size(), 1U);
  EXPECT_FALSE(resumed.bridges.front().is_applied());
  EXPECT_THAT(resumed.warnings,
              testing::Not(testing::Contains(testing::HasSubstr("after an interruption"))));
  EXPECT_LT(worst_deviation(resumed, folder_ / "whole"), 0.001);
}

}  // namespace
}  // namespace gonio
