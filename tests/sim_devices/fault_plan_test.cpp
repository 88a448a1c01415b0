#include "gonio/emulator_faults/fault_plan.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <vector>

namespace gonio::emulator_faults {
namespace {

using namespace std::chrono_literals;
using testing::HasSubstr;
using testing::ThrowsMessage;

TEST(FaultPlan, EmptyPlanNeverStrikes) {
  FaultPlan plan;
  EXPECT_FALSE(plan.strikes(Fault::dead_link, "tilt", 1s));
}

TEST(FaultPlan, StrikesOnlyTheDeviceNamed) {
  FaultPlan plan({fault_rule_from_text("crc_error@tilt")});
  EXPECT_TRUE(plan.strikes(Fault::crc_error, "tilt", 0s));
  EXPECT_FALSE(plan.strikes(Fault::crc_error, "azimuth", 0s));
  EXPECT_FALSE(plan.strikes(Fault::exception, "tilt", 0s));
}

TEST(FaultPlan, TakesRulesWhileInUse) {
  FaultPlan plan;
  EXPECT_FALSE(plan.strikes(Fault::stall, "monitor", 1s));
  plan.add(fault_rule_from_text("stall@monitor:count=1"));
  EXPECT_TRUE(plan.strikes(Fault::stall, "monitor", 2s));
  EXPECT_FALSE(plan.strikes(Fault::stall, "monitor", 3s));
}

TEST(FaultPlan, StrikesWithinItsTimeAndThenWearsOff) {
  FaultPlan plan({fault_rule_from_text("unplug:after_s=5,for_s=2")});
  EXPECT_FALSE(plan.strikes(Fault::unplug, "tilt", 4999ms));
  EXPECT_TRUE(plan.strikes(Fault::unplug, "tilt", 5s));
  EXPECT_TRUE(plan.strikes(Fault::unplug, "tilt", 6999ms));
  EXPECT_FALSE(plan.strikes(Fault::unplug, "tilt", 7s));
}

TEST(FaultPlan, SkipsOpportunitiesAndCountsStrikes) {
  FaultPlan plan({fault_rule_from_text("late_reply:skip=2,count=2")});
  std::vector<bool> struck;
  for (int i = 0; i < 6; ++i) struck.push_back(plan.strikes(Fault::late_reply, "lamp", 0s));
  EXPECT_THAT(struck, testing::ElementsAre(false, false, true, true, false, false));
  EXPECT_EQ(plan.struck(Fault::late_reply), 2U);
}

TEST(FaultPlan, LostStepsSayHowFar) {
  FaultPlan plan({fault_rule_from_text("lost_steps@tilt:skip=1,count=1,degrees=-0.05")});
  EXPECT_EQ(plan.lost_steps_deg("tilt", 1s), 0.0);
  EXPECT_EQ(plan.lost_steps_deg("azimuth", 1s), 0.0);
  EXPECT_EQ(plan.lost_steps_deg("tilt", 1s), -0.05);
  EXPECT_EQ(plan.lost_steps_deg("tilt", 1s), 0.0);
  EXPECT_EQ(plan.struck(Fault::lost_steps), 1U);
}

TEST(FaultPlan, ProbabilityIsASeededShareOfTheOpportunities) {
  constexpr int kTrials = 10000;
  const auto strikes = [](std::uint64_t seed) {
    FaultPlan plan({fault_rule_from_text("lost_packets:probability=0.2")}, seed);
    std::vector<bool> all;
    for (int i = 0; i < kTrials; ++i) all.push_back(plan.strikes(Fault::lost_packets, "cam", 0s));
    return all;
  };
  const std::vector<bool> once = strikes(1);
  EXPECT_NEAR(static_cast<double>(std::count(once.begin(), once.end(), true)), 0.2 * kTrials,
              5.0 * std::sqrt(0.2 * 0.8 * kTrials));  // five sigmas
  EXPECT_EQ(once, strikes(1));
  EXPECT_NE(once, strikes(2));
}

TEST(FaultRule, RefusesWhatItCannotMean) {
  const auto refused = [](const char* text, const char* why) {
    EXPECT_THAT([&] { fault_rule_from_text(text); },
                ThrowsMessage<std::invalid_argument>(HasSubstr(why)))
        << text;
  };
  refused("", "expected one of dead_link");
  refused("deadlink", "found \"deadlink\"");
  refused("stall@", "expected a device");
  refused("stall:count", "expected KEY=VALUE");
  refused("stall:count=-1", "expected a whole number");
  refused("stall:probability=1.5", "expected 0 to 1");
  refused("stall:probability=nan", "expected a number");
  refused("stall:often=1", "expected after_s");
  refused("stall:for_s=0", "expected above 0");
  refused("lost_steps@tilt", "degrees: found 0");
  refused("stall:degrees=1", "only lost_steps");
}

TEST(FaultPlan, MendedShowsNothingMoreAndKnowsWhenItStruckFirst) {
  FaultPlan plan({fault_rule_from_text("stall@tilt:after_s=1")});
  EXPECT_FALSE(plan.strikes(Fault::stall, "tilt", 500ms));
  EXPECT_EQ(plan.first_struck(), std::nullopt);
  EXPECT_TRUE(plan.strikes(Fault::stall, "tilt", 1500ms));
  EXPECT_TRUE(plan.strikes(Fault::stall, "tilt", 1700ms));
  plan.mend();
  EXPECT_FALSE(plan.strikes(Fault::stall, "tilt", 1800ms));
  EXPECT_EQ(plan.first_struck(), 1500ms);
}

}  // namespace
}  // namespace gonio::emulator_faults
