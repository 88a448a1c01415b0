#include "gonio/rig/reach.h"

#include <gtest/gtest.h>

#include "gonio/parallel/parallel.h"
#include "rig_test_support.h"

namespace gonio::rig {
namespace {

using test::deg;

/// Limits of one published figure: lowest theta_d, highest polar angles, tilt, azimuth, arm.
struct Figure {
  double theta_d_min, theta_max, tilt_max, azimuth_max, arm_max;
  double reachable_percent;
};

RigDescription rig_of(const Figure& f) {
  RigDescription rig = la2();
  rig.axes[0].min = Angle();
  rig.axes[0].max = deg(f.arm_max);
  rig.axes[1].min = deg(-f.azimuth_max);
  rig.axes[1].max = deg(f.azimuth_max);
  rig.axes[2].min = Angle();
  rig.axes[2].max = deg(f.tilt_max);
  rig.limits.theta_i_max = rig.limits.theta_o_max = deg(f.theta_max);
  rig.limits.theta_d_min = deg(f.theta_d_min);
  return rig;
}

TEST(Reach, SharesOfTheLatticeAreThePublishedOnes) {
  // Prototype of the reference design, branch A, bin centres, percent of 1,096,216 valid cells.
  const Figure figures[] = {{3, 85, 90, 90, 180, 87.0},
                            {4, 85, 75, 80, 170, 81.6},
                            {4, 80, 75, 80, 160, 77.4},
                            {4, 80, 45, 80, 160, 73.2},
                            {5, 75, 60, 75, 150, 67.8}};
  for (const Figure& figure : figures) {
    const Inverse inverse(rig_of(figure), {false, false, false});
    const ReachStatistics s = reach_statistics(inverse);
    EXPECT_EQ(s.valid_cells, 1096216u);
    const double percent =
        100.0 * static_cast<double>(s.reachable_cells) / static_cast<double>(s.valid_cells);
    EXPECT_NEAR(percent, figure.reachable_percent, 0.05);  // published to one decimal
    std::size_t refused = 0;
    for (const auto& [reason, count] : s.refused) refused += count;
    EXPECT_EQ(refused + s.reachable_cells, s.valid_cells);
  }
}

TEST(Reach, DoesNotDependOnTheNumberOfThreads) {
  const Inverse inverse(la2());
  parallel::set_thread_count(1);
  const ReachStatistics one = reach_statistics(inverse);
  const auto nearest_one = nearest_reachable(inverse, half_diff_deg(2.84, 89.0, 15.0));
  parallel::set_thread_count(2);
  const ReachStatistics two = reach_statistics(inverse);
  const auto nearest_two = nearest_reachable(inverse, half_diff_deg(2.84, 89.0, 15.0));
  parallel::set_thread_count(0);
  EXPECT_EQ(one.reachable, two.reachable);
  EXPECT_EQ(one.refused, two.refused);
  ASSERT_TRUE(nearest_one && nearest_two);
  EXPECT_EQ(nearest_one->direction.theta_d, nearest_two->direction.theta_d);
}

TEST(Reach, OffersAReachableDirectionCloseToARefusedOne) {
  const Inverse inverse(la2());
  const brdf::HalfDiff refused = half_diff_deg(2.84, 89.0, 15.0);
  const auto offer = nearest_reachable(inverse, refused);
  ASSERT_TRUE(offer);
  EXPECT_FALSE(inverse.solve(offer->direction).poses.empty());
  // Both directions have to come back from about 90 to 80 deg, by a good 9 and 12 deg.
  EXPECT_GT(offer->distance, deg(8.0));
  EXPECT_LT(offer->distance, deg(14.0));
}

TEST(Reach, OffersTheCellOfADirectionThatIsReachable) {
  const auto offer = nearest_reachable(Inverse(la2()), half_diff_deg(20.0, 30.5, -79.5));
  ASSERT_TRUE(offer);
  EXPECT_LT(offer->distance, deg(0.6));  // half a cell
  // phi_d = -79.5 is 100.5 by reciprocity, which the lattice takes for granted.
  EXPECT_NEAR(offer->direction.phi_d.degrees(), 100.5, 1e-9);
}

TEST(Reach, OffersNothingWhereNothingIsReachable) {
  RigDescription rig = la2();
  rig.limits.theta_i_max = Angle();
  rig.limits.theta_o_max = Angle();
  EXPECT_FALSE(nearest_reachable(Inverse(rig), half_diff_deg(10.0, 20.0, 30.0)));
}

TEST(Reach, RankTellsAnInPlaneRig) {
  EXPECT_EQ(reach_rank(la2()), 3);
  RigDescription in_plane = la2();
  in_plane.sample.links.pop_back();
  in_plane.axes.pop_back();
  EXPECT_EQ(reach_rank(in_plane), 2);
  RigDescription lamp_only = in_plane;
  lamp_only.sample.links.clear();
  EXPECT_EQ(reach_rank(lamp_only), 1);
}

}  // namespace
}  // namespace gonio::rig
