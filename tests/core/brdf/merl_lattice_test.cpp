#include "gonio/brdf/merl_lattice.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <stdexcept>
#include <thread>
#include <vector>

namespace gonio::brdf::lattice {
namespace {

using namespace gonio::literals;

constexpr IndexConvention kConventions[] = {IndexConvention::left_edge, IndexConvention::bin_centre,
                                            IndexConvention::dtu};

/// Roundings of a square root, a square and a few products at values up to 180.
constexpr double kRounding = 1e-11;

const std::vector<std::uint8_t>& every_cell() {
  static const std::vector<std::uint8_t> all(kCells, 1);
  return all;
}

TEST(MerlLattice, NumbersCellsInTheOrderOfTheFile) {
  EXPECT_EQ(cell_from_index({0, 0, 1}), 1u);
  EXPECT_EQ(cell_from_index({0, 1, 0}), 180u);
  EXPECT_EQ(cell_from_index({1, 0, 0}), 16'200u);
  EXPECT_EQ(cell_from_index({89, 89, 179}), 1'457'999u);
  for (std::size_t cell = 0; cell < kCells; ++cell) {
    ASSERT_EQ(cell_from_index(index_from_cell(cell)), cell);
  }
}

TEST(MerlLattice, PlacesIndicesAsEachConventionSays) {
  const HalfDiff left = angles_of({30, 7, 9}, IndexConvention::left_edge);
  EXPECT_NEAR(left.theta_h.degrees(), 10.0, kRounding);  // 90 / 9
  EXPECT_NEAR(left.theta_d.degrees(), 7.0, kRounding);
  EXPECT_NEAR(left.phi_d.degrees(), 9.0, kRounding);
  const HalfDiff centre = angles_of({22, 7, 9}, IndexConvention::bin_centre);
  EXPECT_NEAR(centre.theta_h.degrees(), 5.625, kRounding);  // 90 / 16
  EXPECT_NEAR(centre.theta_d.degrees(), 7.5, kRounding);
  EXPECT_NEAR(centre.phi_d.degrees(), 9.5, kRounding);
  const HalfDiff dtu = angles_of({89, 89, 179}, IndexConvention::dtu);
  EXPECT_NEAR(dtu.theta_h.degrees(), 88.2189, 1e-4);  // (89.105 / 90)^2 of 90
  EXPECT_NEAR(dtu.theta_d.degrees(), 90.0, kRounding);
  EXPECT_NEAR(dtu.phi_d.degrees(), 180.0, kRounding);
}

TEST(MerlLattice, HasThePublishedNumberOfCellsAboveTheHorizon) {
  EXPECT_EQ(cells_above_horizon(IndexConvention::bin_centre).size(), 1'096'216u);
}

TEST(MerlLattice, ListsExactlyTheCellsWhoseAnglesAreAboveTheHorizon) {
  for (const IndexConvention convention : kConventions) {
    const auto& cells = cells_above_horizon(convention);
    const auto& mask = above_horizon_mask(convention);
    ASSERT_EQ(mask.size(), kCells);
    EXPECT_TRUE(std::is_sorted(cells.begin(), cells.end()));
    EXPECT_EQ(static_cast<std::size_t>(std::count(mask.begin(), mask.end(), 1)), cells.size());
    for (const std::uint32_t cell : cells) ASSERT_EQ(mask[cell], 1);
    for (std::size_t cell = 0; cell < kCells; cell += 101) {
      const HalfDiff at = angles_of(index_from_cell(cell), convention);
      ASSERT_EQ(mask[cell] != 0, above_horizon(at.theta_h, at.theta_d, at.phi_d)) << cell;
    }
  }
}

TEST(MerlLattice, SharesOneListBetweenThreads) {
  const std::vector<std::uint32_t>* seen[4] = {};
  std::vector<std::thread> threads;
  for (auto& slot : seen) {
    threads.emplace_back([&slot] { slot = &cells_above_horizon(IndexConvention::dtu); });
  }
  for (auto& thread : threads) thread.join();
  for (const auto* list : seen) EXPECT_EQ(list, seen[0]);
}

TEST(MerlLattice, FindsEachCellFromItsOwnAngles) {
  for (const IndexConvention convention : kConventions) {
    for (std::size_t cell = 0; cell < kCells; cell += 7) {
      const Index index = index_from_cell(cell);
      ASSERT_EQ(nearest_index(angles_of(index, convention), convention), index)
          << to_string(convention) << " cell " << cell;
    }
  }
}

TEST(MerlLattice, PutsAnglesIntoTheBinThatHoldsThem) {
  const HalfDiff angles{1.4_deg, 4.0_deg, 36.2_deg, 0.0_deg};
  const Index expected{11, 4, 36};  // 90 sqrt(1.4 / 90) = 11.2
  EXPECT_EQ(nearest_index(angles, IndexConvention::bin_centre), expected);
  EXPECT_EQ(nearest_index(angles, IndexConvention::left_edge), expected);
  // dtu: 11.2 - 0.105, 4 * 89 / 90 and 36.2 * 179 / 180 lie nearest to 11, 4 and 36.
  EXPECT_EQ(nearest_index(angles, IndexConvention::dtu), expected);
}

TEST(MerlLattice, FoldsPhiDByReciprocity) {
  for (const IndexConvention convention : kConventions) {
    const Index below = nearest_index({20.0_deg, 30.0_deg, -100.4_deg, 0.0_deg}, convention);
    EXPECT_EQ(below, nearest_index({20.0_deg, 30.0_deg, 79.6_deg, 0.0_deg}, convention));
    const Index beyond = nearest_index({20.0_deg, 30.0_deg, 619.6_deg, 0.0_deg}, convention);
    EXPECT_EQ(beyond, nearest_index({20.0_deg, 30.0_deg, 79.6_deg, 0.0_deg}, convention));
    // The published set writes phi_d = 180 for the last index.
    EXPECT_EQ(nearest_index({2.0_deg, 60.0_deg, 180.0_deg, 0.0_deg}, convention).phi_d, 179);
    EXPECT_EQ(nearest_index({2.0_deg, 60.0_deg, 0.0_deg, 0.0_deg}, convention).phi_d, 0);
  }
}

TEST(MerlLattice, ClampsAnglesThatAreOutOfRange) {
  const Angle nan = Angle::from_radians(std::numeric_limits<double>::quiet_NaN());
  const Angle huge = Angle::from_radians(1e300);
  for (const IndexConvention convention : kConventions) {
    EXPECT_EQ(nearest_index({95.0_deg, 95.0_deg, 10.2_deg, 0.0_deg}, convention),
              (Index{89, 89, 10}));
    EXPECT_EQ(nearest_index({-5.0_deg, -5.0_deg, 10.2_deg, 0.0_deg}, convention),
              (Index{0, 0, 10}));
    EXPECT_EQ(nearest_index({nan, nan, nan, nan}, convention), (Index{0, 0, 0}));
    const Index far = nearest_index({huge, huge, huge, huge}, convention);
    EXPECT_LT(cell_from_index(far), kCells);
    const Corners corners = trilinear_corners({nan, nan, nan, nan}, convention, every_cell());
    ASSERT_GE(corners.count, 1);
    EXPECT_LT(corners.cells[0], kCells);
  }
}

/// A function that is linear between phi_d = 20 and 160 deg in the interpolation's coordinates.
double linear(const HalfDiff& at) {
  return 3.0 + 0.25 * 90.0 * std::sqrt(at.theta_h.degrees() / 90.0) - 0.125 * at.theta_d.degrees() +
         0.5 * at.phi_d.degrees();
}

TEST(TrilinearCorners, ReproduceALinearFunction) {
  std::mt19937_64 generator(7);
  std::uniform_real_distribution<double> theta_h(0.02, 85.0);  // inside the lattice's ends
  std::uniform_real_distribution<double> theta_d(1.0, 88.0);
  std::uniform_real_distribution<double> phi_d(20.0, 160.0);
  for (const IndexConvention convention : kConventions) {
    for (int i = 0; i < 5'000; ++i) {
      const HalfDiff at{Angle::from_degrees(theta_h(generator)),
                        Angle::from_degrees(theta_d(generator)),
                        Angle::from_degrees(phi_d(generator)), Angle()};
      const Corners corners = trilinear_corners(at, convention, every_cell());
      double found = 0.0;
      for (int c = 0; c < corners.count; ++c) {
        found +=
            corners.weights[c] * linear(angles_of(index_from_cell(corners.cells[c]), convention));
      }
      ASSERT_NEAR(found, linear(at), kRounding) << to_string(convention);
    }
  }
}

TEST(TrilinearCorners, GiveTheCellItselfAtItsOwnAngles) {
  for (const IndexConvention convention : kConventions) {
    for (std::size_t cell = 0; cell < kCells; cell += 1'009) {
      const HalfDiff at = angles_of(index_from_cell(cell), convention);
      const Corners corners = trilinear_corners(at, convention, every_cell());
      double weight = 0.0;
      for (int c = 0; c < corners.count; ++c) {
        // In dtu 180 deg is the reciprocal of 0 deg and found as such.
        const bool closes = convention == IndexConvention::dtu && cell % kPhiD == kPhiD - 1;
        if (corners.cells[c] == (closes ? cell - (kPhiD - 1) : cell)) weight = corners.weights[c];
      }
      ASSERT_NEAR(weight, 1.0, kRounding) << to_string(convention) << " cell " << cell;
    }
  }
}

TEST(TrilinearCorners, WrapInPhiDByReciprocity) {
  // 179.75 and -0.25 deg are one direction pair up to a swap: between the last and the first bin.
  for (const Angle phi_d : {179.75_deg, -0.25_deg}) {
    const HalfDiff at{angles_of({40, 0, 0}).theta_h, angles_of({0, 30, 0}).theta_d, phi_d, Angle()};
    const Corners corners = trilinear_corners(at, IndexConvention::bin_centre, every_cell());
    double last = 0.0;
    double first = 0.0;
    for (int c = 0; c < corners.count; ++c) {
      if (corners.cells[c] == cell_from_index({40, 30, 179})) last += corners.weights[c];
      if (corners.cells[c] == cell_from_index({40, 30, 0})) first += corners.weights[c];
    }
    EXPECT_NEAR(last, 0.75, kRounding);
    EXPECT_NEAR(first, 0.25, kRounding);
  }
}

TEST(TrilinearCorners, DropUnusableCellsAndShareTheirWeight) {
  std::vector<std::uint8_t> usable(kCells, 1);
  const HalfDiff at{angles_of({40, 0, 0}).theta_h, angles_of({0, 30, 0}).theta_d, 100.75_deg,
                    Angle()};  // between phi_d indices 100 (weight 0.75) and 101
  usable[cell_from_index({40, 30, 100})] = 0;
  const Corners corners = trilinear_corners(at, IndexConvention::bin_centre, usable);
  double sum = 0.0;
  double kept = 0.0;
  for (int c = 0; c < corners.count; ++c) {
    EXPECT_NE(corners.cells[c], cell_from_index({40, 30, 100}));
    if (corners.cells[c] == cell_from_index({40, 30, 101})) kept = corners.weights[c];
    sum += corners.weights[c];
  }
  EXPECT_NEAR(sum, 1.0, kRounding);
  EXPECT_NEAR(kept, 1.0, 1e-9);
}

TEST(TrilinearCorners, AreNoneWhereNothingIsUsable) {
  const std::vector<std::uint8_t> nothing(kCells, 0);
  const HalfDiff at{20.0_deg, 30.0_deg, 40.0_deg, 0.0_deg};
  EXPECT_EQ(trilinear_corners(at, IndexConvention::bin_centre, nothing).count, 0);
}

TEST(TrilinearCorners, RefuseAMaskOfAnotherSize) {
  const std::vector<std::uint8_t> small(10, 1);
  EXPECT_THROW(trilinear_corners({}, IndexConvention::bin_centre, small), std::invalid_argument);
}

TEST(IndexConventions, ReadBackTheirNamesAndRefuseOthers) {
  for (const IndexConvention convention : kConventions) {
    EXPECT_EQ(index_convention_from_string(to_string(convention)), convention);
  }
  EXPECT_THROW(index_convention_from_string("Bin_Centre"), std::invalid_argument);
  EXPECT_THROW(index_convention_from_string(""), std::invalid_argument);
}

}  // namespace
}  // namespace gonio::brdf::lattice
