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
  parallel::set_thread_count(2);
  const ReachStatistics two = reach_statistics(inverse);
  parallel::set_thread_count(0);
  EXPECT_EQ(one.reachable, two.reachable);
  EXPECT_EQ(one.refused, two.refused);
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
