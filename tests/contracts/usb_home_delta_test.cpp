// What a USB stage tells at its homing of what was lost before, over the wire.

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>

#include "usb_rig.h"

namespace gonio::contracts {
namespace {

using namespace gonio::literals;

constexpr std::chrono::milliseconds kSlowHomePatience{600000};  // of the session
// Home marks are found again to 0.002 deg (one sigma), twice; encoder and drive count in steps.
constexpr Angle kMark = 0.015_deg;

/// So slow that the count is read often enough on a busy machine; on the side of the mark from
/// which it is searched.
sim::SimOptions slow_world() {
  sim::SimOptions world = UsbRig::options(3.0);
  for (std::size_t i = 0; i < world.axes.size(); ++i) {
    world.axes[i].stands_at = world.rig.axes[i].home + 1.0_deg;
  }
  return world;
}

class UsbHomeDelta : public testing::TestWithParam<bool> {
 protected:
  void open(bool confirmed) {
    rig_.counts_until_homed = confirmed;
    stage_ = rig_.open_stage();
    stage_->home(kSlowHomePatience);
  }

  void turn_unseen(const std::string& degrees) {
    rig_.add_fault("lost_steps@azimuth:count=1,degrees=" + degrees);
  }

  UsbRig rig_{GetParam(), slow_world()};
  std::shared_ptr<apt_stage::AptStage> stage_;
};

TEST_P(UsbHomeDelta, IsWithinItsUncertainty) {
  open(true);
  ASSERT_TRUE(stage_->tells());
  double best_deg = 1.0;
  const double slips_deg[] = {0.0, 0.05, -0.05};
  // Once from beyond the mark, whence it is gone round before the search.
  const Angle from[] = {3.0_deg, 2.0_deg, -2.0_deg};
  for (std::size_t i = 0; i < 3; ++i) {
    SCOPED_TRACE(slips_deg[i]);
    stage_->begin_move_to(rig_.axis().home + from[i]);
    const Angle believed = stage_->wait_until_settled(kSlowHomePatience);
    if (slips_deg[i] != 0.0) turn_unseen(std::to_string(slips_deg[i]));
    stage_->home(kSlowHomePatience);
    const auto stood = stage_->stood_before_home();
    ASSERT_TRUE(stood);
    const double delta_deg = (stood->angle - believed).degrees();
    best_deg = std::min(best_deg, stood->within.degrees());
    EXPECT_NEAR(delta_deg, slips_deg[i], (stood->within + kMark).degrees());
    std::printf("slip %+.3f deg: %+.4f deg within %.4f deg\n", slips_deg[i], delta_deg,
                stood->within.degrees());
  }
  EXPECT_LT(best_deg, 0.03) << "of three, because a busy machine may read late";
}

TEST_P(UsbHomeDelta, StandsWhereItWasAfterItsPowerWasOff) {
  open(true);
  // In joint angles the search falls: from here it comes to the mark at once.
  stage_->begin_move_to(rig_.axis().home + 2.0_deg);
  const Angle believed = stage_->wait_until_settled(kSlowHomePatience);
  rig_.bed.cycle_power(UsbRig::kStageName);
  stage_->home(kSlowHomePatience);
  const auto stood = stage_->stood_before_home();
  ASSERT_TRUE(stood);
  EXPECT_NEAR((stood->angle - believed).degrees(), 0.0, (stood->within + kMark).degrees());
}

TEST_P(UsbHomeDelta, IsNotToldUnlessConfirmed) {
  open(false);
  turn_unseen("0.05");
  stage_->home(kSlowHomePatience);
  EXPECT_FALSE(stage_->tells());
  EXPECT_FALSE(stage_->stood_before_home());
}

INSTANTIATE_TEST_SUITE_P(Apt, UsbHomeDelta, testing::Bool(),
                         [](const auto& each) { return each.param ? "reversed" : "forward"; });

}  // namespace
}  // namespace gonio::contracts
