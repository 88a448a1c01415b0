#include "gonio/design/pose_extension.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "pose_fixture.h"
#include "wavy_basis.h"

namespace gonio::design {
namespace {

using brdf::HalfDiff;
using ::testing::Each;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;
using ::testing::ThrowsMessage;

const PoseNoise kNoise{0.05, 0.1, 0.3};

PoseCandidates grid() { return {pose_grid(15.0, anywhere_above_80_deg), {}, {}}; }

std::vector<HalfDiff> some(const std::vector<HalfDiff>& poses,
                           const std::vector<std::size_t>& numbers) {
  std::vector<HalfDiff> chosen;
  for (const std::size_t i : numbers) chosen.push_back(poses[i]);
  return chosen;
}

double error_of(std::vector<HalfDiff> poses, const HalfDiff& one_more, const PatchGeometry& patch) {
  poses.push_back(one_more);
  return expected_error(basis::BasisRows(wavy_basis()), importance(), poses, patch, kNoise);
}

TEST(ExtendPoses, FindsTheReplacementOfLeastExpectedErrorOfAll) {
  const PoseCandidates candidates = grid();
  for (const PatchGeometry& patch :
       {PatchGeometry{}, PatchGeometry::of_half_width(25.0).coarse()}) {
    const std::vector<HalfDiff> kept = some(candidates.poses, {3, 40, 90});
    double least = std::numeric_limits<double>::infinity();
    for (const HalfDiff& each : candidates.poses) {
      least = std::min(least, error_of(kept, each, patch));
    }
    const PoseExtension found =
        extend_poses(wavy_basis(), importance(), candidates, kept, patch, kNoise, 1);
    ASSERT_THAT(found.poses, SizeIs(1));
    EXPECT_NEAR(error_of(kept, found.poses[0], patch), least, kFixpoint * least);
    EXPECT_NEAR(found.after, least, kFixpoint * least);
    EXPECT_LT(found.after, found.before);
  }
}

TEST(ExtendPoses, AddsOneAfterAnotherSoThatFewerAreTheBeginningOfMore) {
  const PoseCandidates candidates = grid();
  const auto extended = [&](int count) {
    return extend_poses(wavy_basis(), importance(), candidates, {}, {}, kNoise, count).poses;
  };
  const std::vector<HalfDiff> five = extended(5);
  const std::vector<HalfDiff> two = extended(2);
  ASSERT_THAT(five, SizeIs(5));
  ASSERT_THAT(two, SizeIs(2));
  for (std::size_t i = 0; i < 2; ++i) EXPECT_EQ(pose_distance(five[i], two[i]), Angle());
}

TEST(ExtendPoses, LooksBetweenTheGridsPosesWhereItMay) {
  PoseCandidates candidates = grid();
  const std::vector<HalfDiff> kept = some(candidates.poses, {3});
  const double coarse =
      extend_poses(wavy_basis(), importance(), candidates, kept, {}, kNoise, 1).after;
  candidates.allowed = anywhere_above_80_deg;
  const double fine =
      extend_poses(wavy_basis(), importance(), candidates, kept, {}, kNoise, 1).after;
  EXPECT_LT(fine, coarse);
}

TEST(ExtendPoses, TakesOnlyWhatIsAccepted) {
  PoseCandidates candidates = grid();
  const std::vector<HalfDiff> accepted = some(candidates.poses, {7, 50});
  candidates.accept = [&](const HalfDiff& pose) {
    return pose_distance(pose, accepted[0]) == Angle() ||
           pose_distance(pose, accepted[1]) == Angle();
  };
  const PoseExtension found =
      extend_poses(wavy_basis(), importance(), candidates, {}, {}, kNoise, 5);
  EXPECT_THAT(found.poses, SizeIs(2)) << "there are no more";
}

TEST(ExtendPoses, StaysAwayFromWhatIsToBeAvoided) {
  PoseCandidates candidates = grid();
  candidates.allowed = anywhere_above_80_deg;
  const Angle distance = Angle::from_degrees(10.0);
  const std::vector<HalfDiff> best =
      extend_poses(wavy_basis(), importance(), candidates, {}, {}, kNoise, 1).poses;
  const std::vector<HalfDiff> next =
      extend_poses(wavy_basis(), importance(), away_from(candidates, best, distance), {}, {},
                   kNoise, 1)
          .poses;
  ASSERT_THAT(next, SizeIs(1));
  EXPECT_GT(pose_distance(best[0], next[0]), distance);
}

TEST(ExtendPoses, RefusesWhatDoesNotFit) {
  const auto extend = [](const Eigen::MatrixXd& weights, int count) {
    return extend_poses(wavy_basis(), weights, grid(), {}, {}, kNoise, count);
  };
  EXPECT_THAT([&] { extend(Eigen::MatrixXd::Identity(3, 3), 1); },
              ThrowsMessage<std::invalid_argument>(HasSubstr("importance of 3 x 3")));
  EXPECT_THAT([&] { extend(importance(), -1); },
              ThrowsMessage<std::invalid_argument>(HasSubstr("count is -1")));
  EXPECT_THAT(extend(importance(), 0).poses, IsEmpty());
}

TEST(PoseDistance, KnowsReciprocityAndThatACircleShrinks) {
  const auto pose = [](double theta_h, double theta_d, double phi_d) {
    return HalfDiff{Angle::from_degrees(theta_h), Angle::from_degrees(theta_d),
                    Angle::from_degrees(phi_d), Angle()};
  };
  constexpr double kRounding_deg = 1e-9;
  EXPECT_NEAR(pose_distance(pose(30, 90, 1), pose(30, 90, 179)).degrees(), 1.0, kRounding_deg);
  EXPECT_NEAR(pose_distance(pose(0, 60, 20), pose(0, 60, 110)).degrees(), 0.0, kRounding_deg)
      << "one geometry under two names";
  EXPECT_NEAR(pose_distance(pose(50, 30, 40), pose(50, 30, 60)).degrees(), 10.0, kRounding_deg);
  EXPECT_NEAR(pose_distance(pose(10, 0, 40), pose(17, 3, 90)).degrees(), 7.0, kRounding_deg);
}

}  // namespace
}  // namespace gonio::design
