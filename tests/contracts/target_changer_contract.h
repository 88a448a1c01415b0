#pragma once

#include <gtest/gtest.h>

#include <functional>
#include <memory>
#include <ostream>
#include <string>

#include "gonio/devices/target_changer.h"

/// What every TargetChanger has to do; see rotation_stage_contract.h for the pattern.
namespace gonio::contracts {

/// Axes stand still and the shutter is closed.
struct ChangerMaker {
  std::string name;
  std::function<std::shared_ptr<devices::TargetChanger>()> make;

  friend std::ostream& operator<<(std::ostream& out, const ChangerMaker& maker) {
    return out << maker.name;
  }
};

class TargetChangerContract : public testing::TestWithParam<ChangerMaker> {
 protected:
  std::shared_ptr<devices::TargetChanger> changer_ = GetParam().make();
};

TEST_P(TargetChangerContract, HasAName) { EXPECT_FALSE(changer_->name().empty()); }

TEST_P(TargetChangerContract, MountsEitherTargetFromEither) {
  using devices::Target;
  for (const Target target :
       {Target::white, Target::white, Target::sample, Target::sample, Target::mirror,
        Target::mirror_turned, Target::board_turned, Target::board, Target::black_trap,
        Target::black_glass, Target::colour_chart, Target::sample}) {
    changer_->mount(target);
    EXPECT_EQ(changer_->mounted(), target);
  }
}

}  // namespace gonio::contracts
