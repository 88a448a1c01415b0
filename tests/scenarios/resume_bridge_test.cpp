// What happened to lamp, white or sample while a session was interrupted.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "gonio/acquisition/trust_notes.h"
#include "gonio/brdf/diffuse_models.h"
#include "gonio/devices/clock.h"
#include "steady_session.h"

namespace gonio {
namespace {

using acquisition::Reduction;
using testing::Contains;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;
using testing::SizeIs;

class ResumeBridge : public SteadySession {
 protected:
  void SetUp() override {
    options_.white_frames = 4;
    begin(folder_ / "whole");
  }

  Reduction resumed_after(const std::function<void()>& meanwhile) {
    interrupt_and_resume(session_, meanwhile);
    return reduced(session_);
  }

  /// The session, stopped after six points and gone on with under a lamp that is brighter by this.
  /// The monitor does not see it.
  Reduction resumed_under(double brighter) {
    return resumed_after([&] { world_.camera.responsivity_e_per_s *= 1.0 + brighter; });
  }

  /// A session of parts that are paused after so many points each; `before` is told of each but the
  /// first that it begins.
  void in_parts(const std::vector<int>& points, const std::function<void(std::size_t)>& before) {
    int done = 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
      done += points[i];
      std::stop_source pause;
      const auto until_done = [&](const acquisition::SessionProgress& now) {
        if (now.done == done - 1) pause.request_stop();
      };
      if (i > 0) {
        before(i);
        resume(session_, until_done, pause.get_token());
        continue;
      }
      sim::SimGoniometer world(world_);
      acquisition::SessionWriter archive(session_, {}, {});
      acquisition::SessionPart part;
      part.pause = pause.get_token();
      run(world, archive, until_done, part);
    }
  }

  std::vector<std::string> notes(const std::string& kind) const { return notes_of(session_, kind); }

  /// Of the mean of each pose's samples, in their common uncertainty.
  double worst_z(const Reduction& found) const {
    const Reduction whole = reduced(folder_ / "whole");
    double worst = 0.0;
    std::map<int, std::array<double, 3>> poses;  // found, whole, u
    for (std::size_t i = 0; i < whole.samples.samples.size(); ++i) {
      const samples::Sample& sample = found.samples.samples.at(i);
      auto& [value, wanted, u] = poses[sample.pose];
      value += sample.value_per_sr.sum();
      wanted += whole.samples.samples[i].value_per_sr.sum();
      u += sample.u_common_per_sr.sum();
    }
    for (const auto& entry : poses) {
      const auto& [value, wanted, u] = entry.second;
      worst = std::max(worst, std::abs(value - wanted) / u);
    }
    return worst;
  }

  /// Whether all samples behind the interruption have the flag, and none before it.
  static void expect_flagged_behind(const Reduction& found, int first_behind) {
    for (const samples::Sample& sample : found.samples.samples) {
      EXPECT_EQ(sample.flags.find("unbridged") != std::string::npos, sample.pose >= first_behind)
          << "pose " << sample.pose << ": " << sample.flags;
    }
  }

  TemporaryFolder folder_;
  std::filesystem::path session_ = folder_ / "session";
};

TEST_F(ResumeBridge, AStepOfTheLampIsBridgedAndTold) {
  const Reduction resumed = resumed_under(0.03);
  ASSERT_EQ(resumed.bridges.size(), 1U);
  const acquisition::PartBridge& bridge = resumed.bridges.front();
  RecordProperty("change", std::to_string(bridge.change_relative));
  RecordProperty("u", std::to_string(bridge.u_relative));
  EXPECT_TRUE(bridge.is_applied());
  EXPECT_FALSE(bridge.by_sentinel) << "a session without sentinels";
  EXPECT_NEAR(bridge.change_relative, 0.03, 3.0 * bridge.u_relative);
  EXPECT_LT(bridge.u_relative, 0.005);
  EXPECT_THAT(resumed.warnings, Contains(HasSubstr("after an interruption")));
  EXPECT_THAT(notes(acquisition::kBridgeNote), Contains(HasSubstr("by whites alone; bridged")));
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
  EXPECT_THAT(resumed.warnings, Not(Contains(HasSubstr("after an interruption"))));
  EXPECT_LT(worst_deviation(resumed, folder_ / "whole"), 0.001);
}

class SentinelBridge : public ResumeBridge {
 protected:
  SentinelBridge() { options_.sentinel_every = 4; }
};

TEST_F(SentinelBridge, WhitesAndSentinelsBridgeAStepOfTheLampTogether) {
  const Reduction resumed = resumed_under(0.03);
  ASSERT_EQ(resumed.bridges.size(), 1U);
  const acquisition::PartBridge& bridge = resumed.bridges.front();
  EXPECT_TRUE(bridge.by_sentinel);
  EXPECT_TRUE(bridge.is_applied());
  EXPECT_NEAR(bridge.change_relative, 0.03, 2.0 * bridge.u_relative);
  EXPECT_LT(bridge.u_relative, 0.002);
  EXPECT_THAT(resumed.warnings, Contains(HasSubstr("by whites and sentinels; bridged")));
  EXPECT_THAT(notes(acquisition::kBridgeNote),
              testing::ElementsAre(HasSubstr("by whites and sentinels; bridged")));
  const double worst = worst_deviation(resumed, folder_ / "whole");
  const double z = worst_z(resumed);
  std::printf(
      "3 %% over an interruption: bridged by %.3f +- %.3f %%, worst deviation %.3f %%, "
      "%.2f of its uncertainty\n",
      100.0 * bridge.change_relative, 100.0 * bridge.u_relative, 100.0 * worst, z);
  EXPECT_LT(worst, 0.005);
  EXPECT_LT(z, 2.0);
  expect_flagged_behind(resumed, 1000);
}

TEST_F(SentinelBridge, AnEvenDriftThroughAnInterruptionLeavesLittle) {
  // 5 % from the beginning to the end, the outage included; the monitor sees none of it.
  interrupt_and_resume(folder_ / "undisturbed");
  const auto end = acquisition::SessionReader(folder_ / "undisturbed").points().back().finished_at;
  world_.lamp.events = {{std::chrono::seconds(0), end, 1.05, false}};
  const Reduction resumed = resumed_after({});
  ASSERT_EQ(resumed.bridges.size(), 1U);
  EXPECT_TRUE(resumed.bridges.front().by_sentinel);
  EXPECT_TRUE(resumed.bridges.front().is_applied()) << to_text(resumed.bridges.front());
  const double worst = worst_deviation(resumed, folder_ / "whole");
  std::printf("5 %% drift through an interruption: worst deviation %.3f %%\n", 100.0 * worst);
  EXPECT_LT(worst, 0.003);
}

TEST_F(SentinelBridge, AWhiteThatBecameDirtyIsNoBridge) {
  const Reduction resumed = resumed_after([&] {
    world_.scene.white_tile = std::make_shared<brdf::Lambertian>(brdf::Rgb::Constant(0.97 * 0.99));
  });
  ASSERT_EQ(resumed.bridges.size(), 1U);
  const acquisition::PartBridge& bridge = resumed.bridges.front();
  EXPECT_TRUE(bridge.is_refused());
  EXPECT_NEAR(bridge.disagreement_relative, -0.03, 3.0 * bridge.u_disagreement_relative);
  EXPECT_THAT(notes(acquisition::kUnbridgedNote), SizeIs(1));
  EXPECT_THAT(notes(acquisition::kBridgeNote), IsEmpty());
  EXPECT_THAT(resumed.warnings, Contains(HasSubstr("unbridged")));
  expect_flagged_behind(resumed, 6);
  // What lies behind is 3 % too bright, and says that it may be.
  EXPECT_GT(worst_deviation(resumed, folder_ / "whole"), 0.025);
  const double z = worst_z(resumed);
  std::printf("a white 3 %% dirtier: worst deviation %.2f of its uncertainty\n", z);
  EXPECT_LT(z, 2.0);
}

TEST_F(SentinelBridge, ASampleThatChangedIsNoBridgeEither) {
  const Reduction resumed = resumed_after(
      [&] { world_.scene.sample = std::make_shared<brdf::Lambertian>(brdf::Rgb::Constant(0.4)); });
  ASSERT_EQ(resumed.bridges.size(), 1U);
  EXPECT_TRUE(resumed.bridges.front().is_refused());
  EXPECT_THAT(notes(acquisition::kUnbridgedNote), SizeIs(1));
  expect_flagged_behind(resumed, 6);
}

TEST_F(SentinelBridge, LevelsOnBothSidesAreTheFactorApart) {
  // Each part with one white, so that nothing is interpolated.
  in_parts({6, 4}, [&](std::size_t) { world_.camera.responsivity_e_per_s *= 1.03; });
  const Reduction good = reduced(session_);
  // Of a few pixels of the white alone, which then is noisier than the sentinel.
  reduction_.white_half_width_mm = reduction_.edge_margin_mm + 2.0;
  const Reduction noisy = reduced(session_);
  ASSERT_TRUE(good.bridges.at(0).is_applied());
  ASSERT_TRUE(noisy.bridges.at(0).is_applied());
  const auto levels = [&](std::size_t sample) -> brdf::Rgb {
    return noisy.samples.samples.at(sample).value_per_sr /
           good.samples.samples.at(sample).value_per_sr;
  };
  const brdf::Rgb found = levels(good.samples.samples.size() - 1) / levels(0);
  const brdf::Rgb wanted = (1.0 + good.bridges[0].relative) / (1.0 + noisy.bridges[0].relative);
  EXPECT_LT((found - wanted).abs().maxCoeff(), 1e-9) << found << "\n" << wanted;
  std::printf("noisy whites: factor %.3f %%, good ones %.3f %%\n",
              100.0 * noisy.bridges[0].change_relative, 100.0 * good.bridges[0].change_relative);
}

TEST_F(SentinelBridge, ALampThatDriftsUpAndIsBackAfterTheInterruptionIsFollowed) {
  const acquisition::SessionReader whole(folder_ / "whole");
  const auto end = whole.points().back().finished_at;
  std::chrono::nanoseconds white{0};
  for (const acquisition::FrameRecord& frame : whole.frames()) {
    if (frame.kind == acquisition::FrameKind::white && frame.exposure_start < end / 2) {
      white = frame.exposure_start;
    }
  }
  // The monitor sees none of it, and it goes on until the session is paused. Then the lamp is as it
  // was at the opening white, so that whites alone would tell nothing.
  constexpr double kUp = 0.05;
  world_.lamp.events = {{std::chrono::seconds(0), end, 1.0 + kUp, false}};
  options_.sentinel_every = 2;
  const Reduction resumed = resumed_after([&] {
    world_.lamp.events.clear();
    world_.camera.responsivity_e_per_s *=
        1.0 + kUp * devices::to_seconds(white) / devices::to_seconds(end);
  });
  ASSERT_EQ(resumed.bridges.size(), 1U);
  EXPECT_FALSE(resumed.bridges[0].is_refused()) << to_text(resumed.bridges[0]);
  EXPECT_FALSE(resumed.bridges[0].is_applied()) << to_text(resumed.bridges[0]);
  const double worst = worst_deviation(resumed, folder_ / "whole");
  std::printf("up 5 %% and back over an interruption: worst deviation %.3f %%\n", 100.0 * worst);
  EXPECT_LT(worst, 0.004);
}

TEST_F(ResumeBridge, APartWhoseWhiteCannotBeUsedIsUnbridgedUnlessTheLightIsTheSame) {
  const auto tile = world_.scene.white_tile;
  for (const double brighter : {0.05, 0.0}) {
    SCOPED_TRACE(brighter);
    session_ = folder_ / (brighter > 0.0 ? "brighter" : "same");
    in_parts({4, 4, 4}, [&](std::size_t part) {
      world_.scene.white_tile =
          part == 1 ? std::make_shared<brdf::Lambertian>(brdf::Rgb::Constant(1e-7)) : tile;
      if (part == 2) world_.camera.responsivity_e_per_s *= 1.0 + brighter;
    });
    const Reduction found = reduced(session_);
    EXPECT_THAT(found.warnings, Contains(HasSubstr("dark or saturated")));
    ASSERT_EQ(found.bridges.size(), 1U);
    EXPECT_EQ(found.bridges[0].is_applied(), brighter > 0.0);
    for (const samples::Sample& sample : found.samples.samples) {
      EXPECT_EQ(sample.flags.find("unbridged") != std::string::npos,
                brighter > 0.0 && sample.pose >= 4 && sample.pose < 8)
          << "pose " << sample.pose << ": " << sample.flags;
    }
    if (brighter > 0.0) {
      EXPECT_THAT(found.warnings, Contains(HasSubstr("unbridged: points 4 5 6 7")));
    } else {
      EXPECT_THAT(found.warnings, Not(Contains(HasSubstr("unbridged"))));
    }
  }
}

TEST_F(SentinelBridge, WhereNothingChangedNothingIsMoved) {
  begin(folder_ / "with sentinels");
  interrupt_and_resume(session_);
  const Reduction resumed = reduced(session_);
  ASSERT_EQ(resumed.bridges.size(), 1U);
  EXPECT_TRUE(resumed.bridges.front().by_sentinel);
  EXPECT_FALSE(resumed.bridges.front().is_applied());
  EXPECT_THAT(notes(acquisition::kBridgeNote), Contains(HasSubstr("no factor is applied")));
  EXPECT_THAT(resumed.warnings, IsEmpty());
  EXPECT_EQ(samples_of(session_), samples_of(folder_ / "with sentinels"));
}

TEST_F(SentinelBridge, NoiseAndHomingContradictNobody) {
  // With other noise after the interruption, homing scatter and a lamp that drifts as lamps do.
  const sim::SimOptions nominal = sim::nominal_options(brdf::builtin_materials().front().model, 7);
  world_.lamp = nominal.lamp;
  world_.axes = nominal.axes;
  world_.same_noise_again = false;
  double largest = 0.0;
  for (std::uint64_t seed = 1; seed <= 8; ++seed) {
    session_ = folder_ / std::to_string(seed);
    world_.noise_seed = seed;
    const Reduction resumed = resumed_after([&] { world_.noise_seed = 100 + seed; });
    ASSERT_EQ(resumed.bridges.size(), 1U);
    const acquisition::PartBridge& bridge = resumed.bridges.front();
    EXPECT_TRUE(bridge.by_sentinel);
    EXPECT_FALSE(bridge.is_refused()) << to_text(bridge);
    largest =
        std::max(largest, std::abs(bridge.disagreement_relative) / bridge.u_disagreement_relative);
  }
  std::printf("8 interruptions: whites and sentinels at most %.2f u apart\n", largest);
  EXPECT_LT(largest, 2.5) << "3 are refused";
}

}  // namespace
}  // namespace gonio
