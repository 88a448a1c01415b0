// What a Modbus drive tells at its homing of what was lost before, over the wire.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>

#include "modbus_rig.h"

namespace gonio::contracts {
namespace {

using namespace gonio::literals;

// Home marks are found again to 0.002 deg (one sigma), twice; encoder and drive count in steps.
constexpr Angle kMark = 0.015_deg;

/// So slow that the count is read often enough on a busy machine; on the side of the mark from
/// which it is searched.
sim::SimOptions slow_world() {
  sim::SimOptions world = running_world_options(2.0);
  for (std::size_t i = 0; i < world.axes.size(); ++i) {
    world.axes[i].stands_at = world.rig.axes[i].home + 1.0_deg;
  }
  return world;
}

/// A drive that has counted from its mark, then stands elsewhere.
class ModbusHomeDelta : public testing::TestWithParam<std::size_t> {
 protected:
  void open(bool confirmed) {
    rig_.counts_until_homed = confirmed;
    stage_ = rig_.stage(GetParam());
    stage_->home(kPatience);
  }

  void turn_unseen(const std::string& degrees) {
    rig_.faults().add(rules({"lost_steps@" + stage_->name() + ":count=1,degrees=" + degrees})[0]);
  }

  ModbusRig rig_{Family::leadshine, {}, {}, slow_world()};
  std::unique_ptr<modbus_stage::ModbusStage> stage_;
};

TEST_P(ModbusHomeDelta, IsWithinItsUncertainty) {
  open(true);
  ASSERT_TRUE(stage_->tells());
  double best_deg = 1.0;
  const Angle home = rig_.world().truth().rig.axes[GetParam()].home;
  for (const double slip_deg : {0.0, 0.05, -0.05}) {
    SCOPED_TRACE(slip_deg);
    stage_->begin_move_to(home + 2.0_deg);
    const Angle believed = stage_->wait_until_settled(kPatience);
    if (slip_deg != 0.0) turn_unseen(std::to_string(slip_deg));
    stage_->home(kPatience);
    const auto stood = stage_->stood_before_home();
    ASSERT_TRUE(stood);
    const double delta_deg = (stood->angle - believed).degrees();
    best_deg = std::min(best_deg, stood->within.degrees());
    EXPECT_NEAR(delta_deg, slip_deg, (stood->within + kMark).degrees());
    std::printf("slip %+.3f deg: %+.4f deg within %.4f deg\n", slip_deg, delta_deg,
                stood->within.degrees());
  }
  EXPECT_LT(best_deg, 0.03) << "of three, because a busy machine may read late";
}

TEST_P(ModbusHomeDelta, StandsWhereItWasAfterItsPowerWasOff) {
  open(true);
  const Angle home = rig_.world().truth().rig.axes[GetParam()].home;
  stage_->begin_move_to(home + 2.0_deg);
  const Angle believed = stage_->wait_until_settled(kPatience);
  rig_.faults().add(rules({"power_cycle:count=1"})[0]);
  stage_->home(kPatience);
  const auto stood = stage_->stood_before_home();
  ASSERT_TRUE(stood);
  EXPECT_NEAR((stood->angle - believed).degrees(), 0.0, (stood->within + kMark).degrees());
}

TEST_P(ModbusHomeDelta, IsNotToldUnlessConfirmed) {
  open(false);
  turn_unseen("0.05");
  stage_->home(kPatience);
  EXPECT_FALSE(stage_->tells());
  EXPECT_FALSE(stage_->stood_before_home());
}

INSTANTIATE_TEST_SUITE_P(Leadshine, ModbusHomeDelta, testing::Values(0U, 1U),
                         [](const auto& each) { return each.param == 0 ? "forward" : "reversed"; });

TEST(ModbusHomeDeltaOfAnAbsoluteEncoder, CannotBeConfirmed) {
  ModbusRig rig(Family::az);
  rig.counts_until_homed = true;
  EXPECT_THAT([&] { rig.stage(0); }, testing::ThrowsMessage<std::invalid_argument>(
                                         testing::HasSubstr("absolute encoder")));
  rig.counts_until_homed = false;
  EXPECT_FALSE(rig.stage(0)->tells());
}

}  // namespace
}  // namespace gonio::contracts
