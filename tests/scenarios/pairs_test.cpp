// Points measured twice, at the same pose or with light and camera exchanged: they agree on a rig
// that is in order, and tell a light that changed though nothing else looked at it.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "steady_session.h"

namespace gonio {
namespace {

using acquisition::PairAgreement;
using testing::Contains;
using testing::HasSubstr;
using testing::Not;

class Pairs : public SteadySession {
 protected:
  Pairs() {
    options_.sentinel_every = 0;
    rig::BranchSet branches;
    plan_ = acquisition::with_pairs(rig::Inverse(known_.rig, branches), plan_, {2, 2});
  }

  TemporaryFolder folder_;
};

TEST_F(Pairs, AgreeOnARigInOrder) {
  EXPECT_TRUE(begin(folder_.path() / "session").complete);
  const acquisition::Reduction found = reduced(folder_.path() / "session");
  int exchanged = 0;
  for (const PairAgreement& pair : found.pairs) {
    EXPECT_LT(pair.first, pair.second);
    EXPECT_TRUE(pair.agrees()) << pair.first << " " << pair.second << " " << pair.change_relative;
    EXPECT_LT(pair.u_relative, 0.01);
    if (pair.exchanged) ++exchanged;
  }
  EXPECT_EQ(exchanged, 2);
  EXPECT_EQ(found.pairs.size(), 4U);
  EXPECT_THAT(found.warnings, Not(Contains(HasSubstr("measured twice"))));
}

TEST_F(Pairs, TellALightThatNothingElseLookedAt) {
  {
    begin(folder_.path() / "untroubled");
    const acquisition::SessionReader whole(folder_.path() / "untroubled");
    // On between the two halves of the repeats, and off again before the closing white.
    const auto middle = whole.points().at(whole.points().size() / 2).finished_at;
    const auto last = whole.points().back().finished_at;
    world_.lamp.events = {{middle, {}, 1.05, false}, {last, {}, 1.0 / 1.05, false}};
  }
  EXPECT_TRUE(begin(folder_.path() / "session").complete);
  const acquisition::Reduction found = reduced(folder_.path() / "session");
  int repeats = 0;
  for (const PairAgreement& pair : found.pairs) {
    if (pair.exchanged) continue;
    ++repeats;
    EXPECT_NEAR(pair.change_relative, 0.05, 4.0 * pair.u_relative);
    EXPECT_FALSE(pair.agrees());
  }
  EXPECT_EQ(repeats, 2);
  EXPECT_THAT(found.warnings, Contains(HasSubstr("one pose measured twice) differ by +")));
}

}  // namespace
}  // namespace gonio
