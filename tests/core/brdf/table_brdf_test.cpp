#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <memory>
#include <random>

#include "gonio/brdf/brdf_table.h"

namespace gonio::brdf {
namespace {

using namespace gonio::literals;

/// A smooth reciprocal function that tells phi_d from -phi_d: the sine of twice phi_d.
class Handed final : public BrdfModel {
 public:
  Rgb evaluate(const DirectionPair& pair) const override {
    const Eigen::Vector3d h = (pair.wi + pair.wo).normalized();
    const Eigen::Vector3d d = pair.wi - pair.wo;
    // n x h spans phi_d = 90 deg and n x h x h phi_d = 0: their product is even under a swap.
    const Eigen::Vector3d across = Eigen::Vector3d::UnitZ().cross(h);
    const double handed = d.dot(across) * d.dot(across.cross(h));
    return {1.0 + handed, 2.0 + pair.wi.dot(pair.wo), 1.5 - 0.5 * handed};
  }
};

const BrdfTable& handed_table() {
  static const BrdfTable table = tabulate(Handed(), RadiometricScale::si);
  return table;
}

const TableBrdf& handed() {
  static const TableBrdf brdf(handed_table());
  return brdf;
}

/// A smooth function over bins of 1 deg (theta_h up to 2 deg): half of second derivative (4) times
/// (1 deg)^2 per axis is below this.
constexpr double kBetweenBins = 2e-3;

DirectionPair random_pair(std::mt19937_64& generator, double lowest_cosine) {
  std::uniform_real_distribution<double> cosine(lowest_cosine, 1.0);
  std::uniform_real_distribution<double> turn(-180.0, 180.0);
  const auto one = [&] {
    return direction(Angle::from_radians(std::acos(cosine(generator))),
                     Angle::from_degrees(turn(generator)));
  };
  const Eigen::Vector3d wi = one();
  return {wi, one()};
}

TEST(TableBrdf, FollowsTheTabulatedFunctionIncludingItsHandedness) {
  std::mt19937_64 generator(21);
  const Handed truth;
  double mirrored = 0.0;
  for (int i = 0; i < 20'000; ++i) {
    const DirectionPair pair = random_pair(generator, 0.05);
    const Rgb expected = truth.evaluate(pair);
    const Rgb found = handed().evaluate(pair);
    ASSERT_LT((found - expected).abs().maxCoeff(), kBetweenBins);
    const Eigen::DiagonalMatrix<double, 3> mirror(1.0, -1.0, 1.0);
    const Rgb flipped = handed().evaluate({mirror * pair.wi, mirror * pair.wo});
    mirrored = std::max(mirrored, (flipped - expected).abs().maxCoeff());
  }
  EXPECT_GT(mirrored, 0.5) << "the function under test would not show a phi sign error";
}

TEST(TableBrdf, IsReciprocal) {
  std::mt19937_64 generator(22);
  for (int i = 0; i < 5'000; ++i) {
    const DirectionPair pair = random_pair(generator, 0.0);
    const Rgb forward = handed().evaluate(pair);
    const Rgb swapped = handed().evaluate(DirectionPair{pair.wo, pair.wi});
    ASSERT_LT((forward - swapped).abs().maxCoeff(), 1e-11);
  }
}

TEST(TableBrdf, GivesTheSameFromDirectionsAndFromAngles) {
  std::mt19937_64 generator(23);
  for (int i = 0; i < 5'000; ++i) {
    const DirectionPair pair = random_pair(generator, 0.01);
    const Rgb from_pair = handed().evaluate(pair);
    const Rgb from_angles = handed().evaluate(half_diff_from_directions(pair));
    ASSERT_LT((from_pair - from_angles).abs().maxCoeff(), 1e-12);
  }
}

TEST(TableBrdf, AgreesWithTheSharedCornersAndWeights) {
  std::mt19937_64 generator(24);
  const auto& usable = lattice::above_horizon_mask();
  for (int i = 0; i < 5'000; ++i) {
    const HalfDiff at = half_diff_from_directions(random_pair(generator, 0.0));
    const lattice::Corners corners =
        lattice::trilinear_corners(at, IndexConvention::bin_centre, usable);
    Rgb expected = Rgb::Zero();
    for (int c = 0; c < corners.count; ++c) {
      expected += corners.weights[c] * handed_table().value(corners.cells[c]);
    }
    ASSERT_LT((handed().evaluate(at) - expected).abs().maxCoeff(), 1e-12);
  }
}

TEST(TableBrdf, ReturnsACellsOwnValueAtItsAngles) {
  const TableBrdf nearest(handed_table(), Interpolation::nearest);
  const auto& cells = lattice::cells_above_horizon();
  for (std::size_t i = 0; i < cells.size(); i += 997) {
    const HalfDiff at = lattice::angles_of(lattice::index_from_cell(cells[i]));
    const Rgb expected = handed_table().value(cells[i]);
    ASSERT_TRUE((nearest.evaluate(at) == expected).all());
    ASSERT_LT((handed().evaluate(at) - expected).abs().maxCoeff(), 1e-10);
  }
}

TEST(TableBrdf, NearestTakesTheBinThatHoldsTheDirection) {
  const TableBrdf nearest(handed_table(), Interpolation::nearest);
  const HalfDiff at{1.4_deg, 4.0_deg, 36.2_deg, 0.0_deg};
  const Rgb expected = handed_table().value(lattice::cell_from_index({11, 4, 36}));
  EXPECT_TRUE((nearest.evaluate(at) == expected).all());
  EXPECT_TRUE((nearest.evaluate(directions_from_half_diff(at)) == expected).all());
}

TEST(TableBrdf, IsZeroAtAndBelowTheHorizon) {
  const Eigen::Vector3d up = direction(30.0_deg, 0.0_deg);
  const Eigen::Vector3d down = direction(91.0_deg, 50.0_deg);
  for (const auto how : {Interpolation::nearest, Interpolation::trilinear}) {
    const TableBrdf brdf(handed_table(), how);
    EXPECT_TRUE((brdf.evaluate(DirectionPair{up, down}) == 0.0).all());
    EXPECT_TRUE((brdf.evaluate(DirectionPair{down, up}) == 0.0).all());
    EXPECT_TRUE((brdf.evaluate(DirectionPair{-up, -up}) == 0.0).all());
    EXPECT_TRUE((brdf.evaluate(HalfDiff{2.84_deg, 89.0_deg, 15.0_deg, Angle()}) == 0.0).all());
  }
}

TEST(TableBrdf, LeavesOutInvalidCornersInsteadOfBlendingThemIn) {
  BrdfTable table = tabulate(Handed(), RadiometricScale::si);
  const lattice::Index hole{40, 30, 100};
  table.set_invalid(lattice::cell_from_index(hole));
  const TableBrdf brdf(table);
  const HalfDiff beside{lattice::angles_of(hole).theta_h, lattice::angles_of(hole).theta_d,
                        100.75_deg, Angle()};
  const Rgb neighbour = table.value(lattice::cell_from_index({40, 30, 101}));
  EXPECT_LT((brdf.evaluate(beside) - neighbour).abs().maxCoeff(), 1e-9);
}

TEST(TableBrdf, IsNonZeroUpToHalfADegreeFromTheHorizon) {
  std::mt19937_64 generator(25);
  for (int i = 0; i < 50'000; ++i) {
    const DirectionPair pair = random_pair(generator, cos(89.5_deg));
    ASSERT_GT(handed().evaluate(pair).minCoeff(), 0.0);
  }
}

TEST(TableBrdf, OutlivesTheTableItWasMadeFrom) {
  auto table = std::make_unique<BrdfTable>(tabulate(Handed(), RadiometricScale::si));
  const TableBrdf brdf(*table);
  table.reset();
  const DirectionPair pair{direction(30.0_deg, 0.0_deg), direction(50.0_deg, 100.0_deg)};
  EXPECT_LT((brdf.evaluate(pair) - Handed().evaluate(pair)).abs().maxCoeff(), kBetweenBins);
}

}  // namespace
}  // namespace gonio::brdf
