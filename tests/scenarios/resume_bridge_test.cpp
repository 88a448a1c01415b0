// What happened to the lamp while a session was interrupted.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <map>

#include "steady_session.h"

namespace gonio {
namespace {

using acquisition::Reduction;
using acquisition::SessionReader;

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
    std::stop_source pause;
    {
      sim::SimGoniometer world(world_);
      acquisition::SessionWriter archive(session, {}, {});
      acquisition::SessionPart part;
      part.pause = pause.get_token();
      run(
          world, archive,
          [&](const acquisition::SessionProgress& now) {
            if (now.done == 5) pause.request_stop();
          },
          part);
    }
    world_.camera.responsivity_e_per_s *= 1.0 + brighter;
    EXPECT_TRUE(resume(session).complete);
    return acquisition::reduce(SessionReader(session), known_, reduction_);
  }

  /// The worst point's mean deviation from the uninterrupted session.
  double worst_deviation(const Reduction& resumed) {
    const Reduction whole =
        acquisition::reduce(SessionReader(folder_ / "whole"), known_, reduction_);
    EXPECT_EQ(resumed.samples.samples.size(), whole.samples.samples.size());
    std::map<int, std::pair<double, double>> sums;
    for (std::size_t i = 0; i < whole.samples.samples.size(); ++i) {
      auto& [before, after] = sums[whole.samples.samples[i].pose];
      before += whole.samples.samples[i].value_per_sr.sum();
      after += resumed.samples.samples[i].value_per_sr.sum();
    }
    EXPECT_EQ(sums.size(), plan_.points.size());
    double worst = 0.0;
    for (const auto& entry : sums) {
      worst = std::max(worst, std::abs(entry.second.second / entry.second.first - 1.0));
    }
    return worst;
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
  const double worst = worst_deviation(resumed);
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
  EXPECT_LT(worst_deviation(resumed), 0.001);
}

}  // namespace
}  // namespace gonio
