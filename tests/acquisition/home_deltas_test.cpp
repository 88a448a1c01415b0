#include "home_deltas.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace gonio::acquisition {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;

Angle deg(double degrees) { return Angle::from_degrees(degrees); }

/// Of an axis that believed to stand at 5 deg.
HomeDelta of(double delta_deg, double within_deg, bool after_outage = false, bool hidden = false) {
  HomingEvidence evidence;
  evidence.homed = true;
  evidence.hidden = hidden;
  evidence.stood = devices::StoodBeforeHome{deg(5.0 + delta_deg), deg(within_deg)};
  return home_delta("tilt", evidence, deg(5.0), after_outage);
}

TEST(HomeDelta, IsComparedWhereItSaysWhetherStepsWereLost) {
  EXPECT_TRUE(of(0.004, 0.0).compared);
  EXPECT_FALSE(of(0.004, 0.015).compared) << "may be nothing but how the count was read";
  EXPECT_TRUE(of(0.02, 0.002).compared);
  EXPECT_THAT(of(0.02, 0.002).lost, IsEmpty());
  EXPECT_THAT(of(0.02, 0.002).text, HasSubstr("more than the usual"));
}

TEST(HomeDelta, IsNoAllClearWithinReachOfALoss) {
  const HomeDelta near_by = of(0.028, 0.025);  // 0.05 deg lost would read so
  EXPECT_FALSE(near_by.compared);
  EXPECT_THAT(near_by.text, HasSubstr("too uncertain to tell"));
}

TEST(HomeDelta, FindsALoss) {
  for (const bool after_outage : {false, true}) {
    const HomeDelta found = of(-0.05, 0.01, after_outage);
    EXPECT_TRUE(found.compared);
    EXPECT_THAT(found.lost, HasSubstr("-0.0500 deg"));
  }
}

TEST(HomeDelta, OfAnAxisThatWasOnItsWayTellsNothing) {
  EXPECT_THAT(of(2.0, 0.0).lost, HasSubstr("+2.0000 deg"));
  const HomeDelta interrupted = of(2.0, 0.0, true);
  EXPECT_FALSE(interrupted.compared);
  EXPECT_THAT(interrupted.lost, IsEmpty());
}

TEST(HomeDelta, BehindAHomingThatToldNothingIsNoAllClear) {
  EXPECT_FALSE(of(0.0, 0.0, false, true).compared);
  EXPECT_THAT(of(0.05, 0.0, false, true).lost, HasSubstr("+0.0500 deg"));
  EXPECT_FALSE(home_delta("tilt", {true, std::nullopt, true}, deg(5.0), false).compared);
}

}  // namespace
}  // namespace gonio::acquisition
