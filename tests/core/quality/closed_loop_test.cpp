#include "gonio/quality/closed_loop.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "paints.h"

namespace gonio::quality {
namespace {

using brdf::HalfDiff;
using ::testing::ElementsAre;
using ::testing::IsEmpty;

const design::PoseNoise kNoise{0.03, 0.0, 0.3};

samples::SampleSet without_poses_from(samples::SampleSet set, int pose) {
  std::erase_if(set.samples, [&](const samples::Sample& sample) { return sample.pose >= pose; });
  return set;
}

design::PoseCandidates grid() {
  const auto allowed = [](const HalfDiff& pose) {
    return design::within(design::DirectionLimits{}, pose);
  };
  return {design::pose_grid(15.0, allowed), {}, {}};
}

NextPose next_pose() { return {trained(), grid(), {}, kNoise}; }

TEST(Prospect, SaysNothingOfFewerThanFivePoses) {
  const samples::SampleSet ten = measured(Paint(40));
  EXPECT_FALSE(prospect(trained(), without_poses_from(ten, 4)).has_value());
  EXPECT_TRUE(prospect(trained(), without_poses_from(ten, 5)).has_value());
}

TEST(Prospect, DoubtsWhatTheBasisHasNotSeen) {
  for (const int index : {40, 57, 63}) {
    const std::optional<Prospect> usual = prospect(trained(), measured(Paint(index)));
    const std::optional<Prospect> foreign = prospect(trained(), measured(Paint(index, 1.2)));
    ASSERT_TRUE(usual && foreign);
    EXPECT_FALSE(usual->doubtful) << index;
    EXPECT_TRUE(foreign->doubtful) << index;
  }
}

TEST(Prospect, KeepsAMarginBelowWhatIsForeseen) {
  const std::optional<Prospect> seen = prospect(trained(), measured(Paint(40)));
  ASSERT_TRUE(seen);
  const double foreseen_db = seen->outlook.expected_psnr_db;
  EXPECT_TRUE(seen->reaches(foreseen_db - kStopMargin_db - 0.01));
  EXPECT_FALSE(seen->reaches(foreseen_db - kStopMargin_db + 0.01));
}

TEST(OutlyingPoses, AreThoseThatDoNotFitTheOthers) {
  samples::SampleSet set = measured(Paint(40));
  EXPECT_THAT(prospect(trained(), set)->outliers, IsEmpty());
  set.samples[3].value_per_sr *= 3.0;
  set.samples[3].sigma_per_sr *= 3.0;
  EXPECT_THAT(prospect(trained(), set)->outliers, ElementsAre(set.samples[3].pose));
  for (samples::Sample& sample : set.samples) sample.pose = -1;
  EXPECT_THAT(prospect(trained(), set)->outliers, ElementsAre(-1 - 3));
}

TEST(NextPose, StaysAwayFromWhatCouldNotBeMeasured) {
  const NextPose choose = next_pose();
  const std::vector<HalfDiff> kept = design::published_set("nielsen-10").directions;
  const std::optional<HalfDiff> first = choose.next(kept, {});
  ASSERT_TRUE(first);
  const std::optional<HalfDiff> other = choose.next(kept, {*first});
  ASSERT_TRUE(other);
  EXPECT_GT(design::pose_distance(*first, *other), kKeptAway);
}

TEST(NextPose, FindsNoneWhereAllAreToBeAvoided) {
  EXPECT_FALSE(next_pose().next({}, grid().poses).has_value());
}

TEST(NextPose, GainsLessFromMorePosesTheMoreThereAre) {
  const NextPose choose = next_pose();
  std::vector<HalfDiff> kept;
  while (kept.size() < 5) kept.push_back(choose.next(kept, {}).value());
  const double beside_five_db = choose.gain_db(kept, 10);
  while (kept.size() < 20) kept.push_back(choose.next(kept, {}).value());
  const double beside_twenty_db = choose.gain_db(kept, 10);
  EXPECT_GT(beside_five_db, 0.1);
  EXPECT_LT(beside_twenty_db, beside_five_db);
  EXPECT_GE(beside_twenty_db, 0.0);
  EXPECT_EQ(choose.gain_db(kept, 0), 0.0);
}

}  // namespace
}  // namespace gonio::quality
