#include "gonio/design/pose_exchange.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/LU>

#include <algorithm>
#include <cmath>

#include <set>

#include "design_fixture.h"
#include "gonio/design/criteria.h"
#include "gonio/design/exchange.h"
#include "gonio/parallel/parallel.h"
#include "pose_fixture.h"
#include "wavy_basis.h"

namespace gonio::design {
namespace {

using brdf::HalfDiff;
using ::testing::Each;
using ::testing::HasSubstr;
using ::testing::SizeIs;
using ::testing::ThrowsMessage;

PoseDesignOptions pose_options(int poses) {
  PoseDesignOptions options;
  options.pose_count = poses;
  options.noise = {0.05, 0.1, 0.3};
  options.refine_step_deg = 0.0;
  return options;
}

double error_of(const std::vector<HalfDiff>& poses, const PatchGeometry& patch,
                const PoseDesignOptions& options) {
  return expected_error(basis::BasisRows(wavy_basis()), importance(), poses, patch, options.noise);
}

bool has(const std::vector<HalfDiff>& poses, const HalfDiff& pose) {
  return std::any_of(poses.begin(), poses.end(), [&](const HalfDiff& each) {
    return each.theta_h == pose.theta_h && each.theta_d == pose.theta_d && each.phi_d == pose.phi_d;
  });
}

/// Information and covariance written out: no Woodbury, no roots.
TEST(PoseInformation, IsThatOfCorrelatedSubSamples) {
  const basis::BasisRows rows(wavy_basis());
  const HalfDiff pose{
      Angle::from_degrees(20), Angle::from_degrees(40), Angle::from_degrees(70), {}};
  const PatchGeometry patch = PatchGeometry::of_half_width(25.0).coarse();
  const PoseNoise noise{0.05, 0.1, 0.3};
  const std::vector<HalfDiff> directions = patch_directions(pose, patch);
  const Eigen::MatrixXd a = rows_at(rows, directions);
  const double m = 30.0;
  Eigen::MatrixXd covariance = Eigen::MatrixXd::Constant(9, 9, 0.1 * 0.1);
  covariance.diagonal().array() += 0.05 * 0.05 + 0.3 / m;
  const Eigen::MatrixXd expected = a.transpose() * covariance.inverse() * a / m;
  const Eigen::MatrixXd found = pose_rows(rows, pose, patch, noise);
  EXPECT_LT((found.transpose() * found - expected).norm(), kRounding * expected.norm());
}

TEST(PoseInformation, GrowsWithTheSampleAndFallsWithNoise) {
  const std::vector<HalfDiff> poses = {
      {Angle::from_degrees(20), Angle::from_degrees(40), Angle::from_degrees(70), {}}};
  PoseDesignOptions options = pose_options(1);
  const double point = error_of(poses, {}, options);
  const double small = error_of(poses, PatchGeometry::of_half_width(12.0), options);
  const double large = error_of(poses, PatchGeometry::of_half_width(50.0), options);
  EXPECT_LT(small, point);
  EXPECT_LT(large, small);
  options.noise.common = 0.5;
  EXPECT_GT(error_of(poses, PatchGeometry::of_half_width(50.0), options), large);
}

TEST(PatchGeometry, LetsCameraAndLampSeeTheCentreAsAsked) {
  const HalfDiff pose{
      Angle::from_degrees(20), Angle::from_degrees(40), Angle::from_degrees(70), {}};
  const std::vector<HalfDiff> directions =
      patch_directions(pose, PatchGeometry::of_half_width(25.0));
  ASSERT_THAT(directions, SizeIs(25));
  EXPECT_NEAR(directions[12].theta_h.degrees(), 20.0, kRounding);
  EXPECT_NEAR(directions[12].theta_d.degrees(), 40.0, kRounding);
  EXPECT_NEAR(directions[12].phi_d.degrees(), 70.0, kRounding);
  EXPECT_EQ(PatchGeometry::of_half_width(50.0).grid, 7);
  EXPECT_EQ(PatchGeometry::of_half_width(12.0).grid, 3);
}

TEST(PatchGeometry, CoarseKeepsTheOutermostDirections) {
  const HalfDiff pose{
      Angle::from_degrees(20), Angle::from_degrees(40), Angle::from_degrees(70), {}};
  const PatchGeometry fine = PatchGeometry::of_half_width(25.0);
  const std::vector<HalfDiff> all = patch_directions(pose, fine);
  const std::vector<HalfDiff> few = patch_directions(pose, fine.coarse());
  ASSERT_THAT(few, SizeIs(9));
  for (const auto& [of_few, of_all] : {std::pair{0, 0}, {2, 4}, {4, 12}, {6, 20}, {8, 24}}) {
    const HalfDiff& a = few[static_cast<std::size_t>(of_few)];
    const HalfDiff& b = all[static_cast<std::size_t>(of_all)];
    EXPECT_NEAR(a.theta_h.degrees(), b.theta_h.degrees(), kRounding);
    EXPECT_NEAR(a.phi_d.degrees(), b.phi_d.degrees(), kRounding);
  }
  EXPECT_TRUE(PatchGeometry{}.coarse().is_point());
}

TEST(PatchGeometry, StaysAboveTheHorizonHoweverWide) {
  const HalfDiff pose{Angle(), Angle::from_degrees(80), Angle(), {}};
  const std::vector<HalfDiff> seen = patch_directions(pose, PatchGeometry::of_half_width(900.0));
  for (const HalfDiff& each : seen) {
    EXPECT_TRUE(brdf::above_horizon(each.theta_h, each.theta_d, each.phi_d));
  }
}

TEST(ChoosePoses, FindsTheBestTripleOfAll) {
  PoseCandidates candidates{pose_grid(15.0, anywhere_above_80_deg), {}, {}};
  candidates.poses.resize(26);
  const PatchGeometry patch = PatchGeometry::of_half_width(25.0).coarse();
  const PoseDesignOptions options = pose_options(3);
  double least = 1e300;
  for (std::size_t a = 0; a < 26; ++a) {
    for (std::size_t b = a + 1; b < 26; ++b) {
      for (std::size_t c = b + 1; c < 26; ++c) {
        least = std::min(
            least, error_of({candidates.poses[a], candidates.poses[b], candidates.poses[c]}, patch,
                            options));
      }
    }
  }
  const PoseDesign design = choose_poses(wavy_basis(), importance(), candidates, patch, options);
  EXPECT_NEAR(design.value, least, kFixpoint * least);
  EXPECT_TRUE(design.finished);
  EXPECT_EQ(design.starts, options.starts);
}

class ChoosePosesPatches : public ::testing::TestWithParam<double> {};
INSTANTIATE_TEST_SUITE_P(HalfWidths, ChoosePosesPatches, ::testing::Values(0.0, 25.0));

TEST_P(ChoosePosesPatches, LeavesNoSwapThatHelps) {
  const PoseCandidates candidates{pose_grid(10.0, anywhere_above_80_deg), {}, {}};
  const PatchGeometry patch = PatchGeometry::of_half_width(GetParam()).coarse();
  PoseDesignOptions options = pose_options(5);
  options.start_candidates = 100;  // the last word is spoken over all of them
  const PoseDesign design = choose_poses(wavy_basis(), importance(), candidates, patch, options);
  ASSERT_THAT(design.poses, SizeIs(5));
  EXPECT_NEAR(design.value, error_of(design.poses, patch, options), kRounding * design.value);
  for (std::size_t i = 0; i < 5; ++i) {
    std::vector<HalfDiff> swapped = design.poses;
    for (const HalfDiff& pose : candidates.poses) {
      if (has(design.poses, pose)) continue;
      swapped[i] = pose;
      ASSERT_GT(error_of(swapped, patch, options), design.value * (1.0 - kFixpoint));
    }
  }
}

TEST(ChoosePoses, IsThePointDesignWithoutAPatch) {
  // The exchange over lattice cells, restricted to the cells the poses stand on.
  std::vector<std::uint32_t> cells;
  PoseCandidates candidates;
  for (std::uint32_t cell = 0; cell < basis_cell_count(); cell += 5000) {
    cells.push_back(cell);
    candidates.poses.push_back(direction_of_basis_cell(cell));
  }
  Candidates points;
  points.allowed.assign(basis_cell_count(), 0);
  for (const std::uint32_t cell : cells) points.allowed[cell] = 1;
  ExchangeOptions settings;
  settings.sample_count = 4;
  settings.eta = 0.7;
  PoseDesignOptions options = pose_options(4);
  options.noise = {0.0, 0.0, settings.eta};
  const Design design = exchange(wavy_basis().components, importance(), points, settings);
  const PoseDesign poses = choose_poses(wavy_basis(), importance(), candidates, {}, options);
  EXPECT_NEAR(poses.value, design.value / wavy_basis().row_count(), kFixpoint * poses.value);
}

TEST(ChoosePoses, RefinesBetweenTheGridAndOnlyWhereAllowed) {
  const auto allowed = [](const HalfDiff& pose) {
    return anywhere_above_80_deg(pose) && pose.theta_d.degrees() > 33.0;
  };
  const PatchGeometry patch = PatchGeometry::of_half_width(25.0).coarse();
  PoseCandidates candidates{pose_grid(15.0, allowed), {}, {}};
  PoseDesignOptions options = pose_options(4);
  options.refine_step_deg = 3.0;
  const PoseDesign coarse = choose_poses(wavy_basis(), importance(), candidates, patch, options);
  candidates.allowed = allowed;
  const PoseDesign fine = choose_poses(wavy_basis(), importance(), candidates, patch, options);
  EXPECT_LT(fine.value, 0.999 * coarse.value) << "fifteen degrees are too coarse not to gain";
  for (const HalfDiff& pose : fine.poses) {
    EXPECT_TRUE(allowed(pose));
    EXPECT_GE(pose.phi_d.degrees(), 0.0);
    EXPECT_LT(pose.phi_d.degrees(), 180.0);
  }
}

TEST(ChoosePoses, AsksTheRigOnlyAboutWhatItWouldChoose) {
  PoseCandidates candidates{pose_grid(10.0, anywhere_above_80_deg), {}, {}};
  std::size_t asked = 0;
  candidates.accept = [&](const HalfDiff& pose) {
    ++asked;
    return pose.phi_d.degrees() < 90.0;
  };
  const PoseDesign design =
      choose_poses(wavy_basis(), importance(), candidates, {}, pose_options(4));
  for (const HalfDiff& pose : design.poses) EXPECT_LT(pose.phi_d.degrees(), 90.0);
  EXPECT_LT(asked, candidates.poses.size() / 2);
}

TEST(ChoosePoses, GivesTheSameBytesForAnyNumberOfThreads) {
  const PoseCandidates candidates{pose_grid(6.0, anywhere_above_80_deg), anywhere_above_80_deg, {}};
  PoseDesignOptions options = pose_options(4);
  options.refine_step_deg = 1.0;
  options.start_candidates = 500;
  options.starts = 3;
  const auto run = [&](unsigned threads) {
    parallel::set_thread_count(threads);
    return choose_poses(wavy_basis(), importance(), candidates,
                        PatchGeometry::of_half_width(25.0).coarse(), options);
  };
  const PoseDesign one = run(1);
  const PoseDesign three = run(3);
  parallel::set_thread_count(0);
  EXPECT_EQ(one.value, three.value);
  ASSERT_EQ(one.poses.size(), three.poses.size());
  for (const HalfDiff& pose : one.poses) EXPECT_TRUE(has(three.poses, pose));
}

TEST(ChoosePoses, KeepsTheBestSoFarWhenStopped) {
  const PoseCandidates candidates{pose_grid(10.0, anywhere_above_80_deg), {}, {}};
  const PoseDesignOptions options = pose_options(4);
  std::stop_source stop;
  stop.request_stop();
  const PoseDesign greedy =
      choose_poses(wavy_basis(), importance(), candidates, {}, options, {}, stop.get_token());
  EXPECT_THAT(greedy.poses, SizeIs(4));
  EXPECT_FALSE(greedy.finished);
  const PoseDesign whole = choose_poses(wavy_basis(), importance(), candidates, {}, options);
  EXPECT_LE(whole.value, greedy.value);
}

TEST(ChoosePoses, TellsAProgressThatNeverFalls) {
  const PoseCandidates candidates{
      pose_grid(10.0, anywhere_above_80_deg), anywhere_above_80_deg, {}};
  PoseDesignOptions options = pose_options(4);
  options.refine_step_deg = 2.0;
  options.start_candidates = 100;
  std::vector<double> fractions;
  std::vector<double> best;
  const PoseDesign design = choose_poses(wavy_basis(), importance(), candidates, {}, options,
                                         [&](const SearchProgress& now) {
                                           fractions.push_back(now.fraction);
                                           best.push_back(now.best);
                                         });
  EXPECT_TRUE(std::is_sorted(fractions.begin(), fractions.end()));
  EXPECT_TRUE(std::is_sorted(best.rbegin(), best.rend()));
  EXPECT_EQ(fractions.back(), 1.0);
  EXPECT_NEAR(best.back(), design.value, kFixpoint * design.value);
}

TEST(ChoosePoses, RefusesWhatCannotBe) {
  const PoseCandidates candidates{pose_grid(30.0, anywhere_above_80_deg), {}, {}};
  const auto with = [&](int poses) {
    return [&, poses] {
      choose_poses(wavy_basis(), importance(), candidates, {}, pose_options(poses));
    };
  };
  EXPECT_THAT(with(1000), ThrowsMessage<std::invalid_argument>(HasSubstr("usable poses for 1000")));
  EXPECT_THAT(with(0), ThrowsMessage<std::invalid_argument>(HasSubstr("pose_count is 0")));
  EXPECT_THAT(
      [&] {
        choose_poses(wavy_basis(), Eigen::MatrixXd::Identity(2, 2), candidates, {},
                     pose_options(1));
      },
      ThrowsMessage<std::invalid_argument>(HasSubstr("2 x 2 for 6 components")));
  EXPECT_THROW(pose_grid(0.1, {}), std::invalid_argument);
  PatchGeometry patch;
  patch.half_width_mm = -1.0;
  EXPECT_THROW(patch.validate(), std::invalid_argument);
}

}  // namespace
}  // namespace gonio::design
