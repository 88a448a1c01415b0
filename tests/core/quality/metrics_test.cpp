#include "gonio/quality/metrics.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <stdexcept>

#include "gonio/parallel/parallel.h"

namespace gonio::quality {
namespace {

using brdf::BrdfTable;
using brdf::IndexConvention;
using brdf::RadiometricScale;
using brdf::Rgb;
namespace lattice = brdf::lattice;

constexpr double kRounding = 1e-9;

/// `per_sr(cell)` at every cell above the horizon.
template <typename Function>
BrdfTable table_of(Function per_sr, RadiometricScale scale = RadiometricScale::si) {
  BrdfTable table(IndexConvention::bin_centre, scale);
  for (const std::uint32_t cell : lattice::cells_above_horizon())
    table.set_value(cell, per_sr(cell));
  return table;
}

BrdfTable grey(double per_sr) {
  return table_of([=](std::size_t) { return Rgb::Constant(per_sr); });
}

TEST(LatticeError, IsZeroForTheSameTable) {
  const BrdfTable table = grey(0.2);
  const LatticeError error = lattice_error(table, table);
  EXPECT_EQ(error.weighted_log_rmse, 0.0);
  EXPECT_EQ(error.grazing_log_rmse, 0.0);
  EXPECT_EQ(error.raw_rmse_per_sr, 0.0);
  EXPECT_EQ(error.cells, 1'096'216u);  // bin centres above the horizon
}

TEST(LatticeError, OfAScaledTableIsTheLogOfTheScaleWhereTheMappingIsALogarithm) {
  // With eps tiny, g(c f) - g(f) = ln c at every cell: RMSE and bias are known by hand.
  const basis::LogMapping pure{1e-12, 0.01};
  const LatticeError error = lattice_error(grey(0.2), grey(0.3), pure);
  constexpr double kEpsilonLeft = 1e-8;  // what eps / (f w) still moves
  EXPECT_NEAR(error.weighted_log_rmse, std::log(1.5), kEpsilonLeft);
  EXPECT_NEAR(error.weighted_log_bias, std::log(1.5), kEpsilonLeft);
  EXPECT_NEAR(error.grazing_log_rmse, std::log(1.5), kEpsilonLeft);
  EXPECT_NEAR(error.grazing_log_bias, std::log(1.5), kEpsilonLeft);
  EXPECT_NEAR(error.raw_rmse_per_sr, 0.1, kRounding);

  const LatticeError darker = lattice_error(grey(0.3), grey(0.2), pure);
  EXPECT_NEAR(darker.grazing_log_bias, -std::log(1.5), kEpsilonLeft);
}

TEST(LatticeError, OfOneChannelIsSpreadOverAllThree) {
  const basis::LogMapping pure{1e-12, 0.01};
  const BrdfTable red = table_of([](std::size_t) { return Rgb(0.4, 0.2, 0.2); });
  const LatticeError error = lattice_error(grey(0.2), red, pure);
  EXPECT_NEAR(error.weighted_log_rmse, std::log(2.0) / std::sqrt(3.0), 1e-8);
  EXPECT_NEAR(error.weighted_log_bias, std::log(2.0) / 3.0, 1e-8);
}

TEST(LatticeError, AddsEpsilonAsTheMappingSays) {
  // f w = 0 and w whatever: g = ln eps. f w >> eps elsewhere. One decade of f w + eps at f = 0
  // against w f = 9 eps needs w known: take f = 0.9 at cells whose w is clipped to 0.01.
  const basis::LogMapping mapping;  // eps 0.001, floor 0.01
  BrdfTable truth = grey(0.0);
  BrdfTable found = grey(0.0);
  std::size_t changed = 0;
  for (const std::uint32_t cell : lattice::cells_above_horizon()) {
    const brdf::HalfDiff a = lattice::angles_of(lattice::index_from_cell(cell));
    const brdf::PolarCosines c = brdf::polar_cosines(a.theta_h, a.theta_d, a.phi_d);
    if (c.cos_theta_i * c.cos_theta_o < 0.01) {
      found.set_value(cell, Rgb::Constant(0.9));
      ++changed;
    }
  }
  const LatticeError error = lattice_error(truth, found, mapping);
  const double share = static_cast<double>(changed) / static_cast<double>(error.cells);
  EXPECT_NEAR(error.raw_rmse_per_sr, 0.9 * std::sqrt(share), kRounding);
  // ln((0.009 + 0.001)/0.001) = ln 10 at the changed cells of the ring, 0 at the others.
  const double ring_share = error.grazing_log_bias / std::log(10.0);
  EXPECT_NEAR(error.grazing_log_rmse, std::log(10.0) * std::sqrt(ring_share), kRounding);
  EXPECT_GT(ring_share, 0.0);
  EXPECT_LT(ring_share, 1.0);
}

TEST(LatticeError, TakesGrazingCellsFromTheRingAndFromNowhereElse) {
  const auto largest_polar_deg = [](std::size_t cell) {
    const brdf::HalfDiff a = lattice::angles_of(lattice::index_from_cell(cell));
    const brdf::DirectionPair pair = brdf::directions_from_half_diff(a);
    return Angle::from_radians(std::acos(std::min(pair.wi.z(), pair.wo.z()))).degrees();
  };
  const BrdfTable off_the_ring = table_of([&](std::size_t cell) {
    const double polar = largest_polar_deg(cell);
    return Rgb::Constant(polar < 65.0 || polar > 85.0 ? 0.9 : 0.2);
  });
  EXPECT_EQ(lattice_error(grey(0.2), off_the_ring).grazing_log_rmse, 0.0);

  const BrdfTable in_the_ring = table_of([&](std::size_t cell) {
    const double polar = largest_polar_deg(cell);
    return Rgb::Constant(polar >= 65.0 && polar <= 85.0 ? 0.4 : 0.2);
  });
  const basis::LogMapping pure{1e-12, 0.01};
  EXPECT_NEAR(lattice_error(grey(0.2), in_the_ring, pure).grazing_log_bias, std::log(2.0), 1e-8);
}

TEST(LatticeError, WeighsACellBySolidAngleAndCosines) {
  // All of the error in one cell: its squared share of W is what is left of ln 2. The weight's
  // figures were worked out with a pocket calculator for cell (45, 20, 90):
  // th = 90 (45.5/90)^2 = 23.0028 deg = 0.401474 rad, td = 20.5 deg, pd = 90.5 deg;
  // sin th sqrt(th) = 0.390793 * 0.633620 = 0.247615, sin td cos td = 0.328029;
  // cos ti cos to = (cos th cos td)^2 - (sin th sin td cos pd)^2 = 0.743357 - 0.0000014.
  constexpr double kWeight = 0.247615 * 0.328029 * 0.743356;
  const basis::LogMapping pure{1e-12, 0.01};
  const std::size_t cell = lattice::cell_from_index({45, 20, 90});
  BrdfTable one = grey(0.2);
  one.set_value(cell, Rgb::Constant(0.4));
  const double squared_first = std::pow(lattice_error(grey(0.2), one, pure).weighted_log_rmse, 2);

  // The same for a second cell, at the pole and near normal incidence: th = 0.002778 deg ...
  // cell (0, 0, 0): th = 90 (0.5/90)^2 deg = 4.84814e-5 rad, td = 0.5 deg;
  // sin th sqrt(th) = 3.37567e-7, sin td cos td = 0.00872620, cosines (cos 0.5 deg)^2 = 0.999924.
  constexpr double kPoleWeight = 3.37567e-7 * 0.00872620 * 0.999924;
  BrdfTable pole = grey(0.2);
  pole.set_value(lattice::cell_from_index({0, 0, 0}), Rgb::Constant(0.4));
  const double squared_second = std::pow(lattice_error(grey(0.2), pole, pure).weighted_log_rmse, 2);
  EXPECT_NEAR(squared_first / squared_second / (kWeight / kPoleWeight), 1.0, 1e-4);
}

TEST(LatticeError, ComparesOnlyCellsValidInBothAndCountsTheRest) {
  BrdfTable truth = grey(0.2);
  BrdfTable found = grey(0.2);
  const std::vector<std::uint32_t>& cells = lattice::cells_above_horizon();
  for (std::size_t i = 0; i < 100; ++i) found.set_invalid(cells[i * 1000]);
  for (std::size_t i = 0; i < 40; ++i) truth.set_invalid(cells[i * 1000 + 7]);
  found.set_value(cells[40'007], Rgb::Constant(std::numeric_limits<float>::max()));
  truth.set_invalid(cells[40'007]);  // an absurd value where the truth is unknown must not count

  // Real MERL files are valid in 55,958 cells below the horizon; they must not count either.
  const std::vector<std::uint8_t>& above = lattice::above_horizon_mask();
  std::size_t below = 0;
  while (above[below] != 0) ++below;
  truth.set_value(below, Rgb::Constant(0.2));
  found.set_value(below, Rgb::Constant(0.9));

  const LatticeError error = lattice_error(truth, found);
  EXPECT_EQ(error.raw_rmse_per_sr, 0.0);
  EXPECT_EQ(error.only_in_truth, 100u);
  EXPECT_EQ(error.only_in_found, 41u);
  EXPECT_EQ(error.cells, cells.size() - 141u);
}

TEST(LatticeError, RefusesTablesThatMeanDifferentThings) {
  const BrdfTable si(IndexConvention::bin_centre, RadiometricScale::si);
  const BrdfTable merl(IndexConvention::bin_centre, RadiometricScale::merl);
  const BrdfTable edge(IndexConvention::left_edge, RadiometricScale::si);
  EXPECT_THROW(lattice_error(si, merl), std::invalid_argument);
  EXPECT_THROW(lattice_error(si, edge), std::invalid_argument);
  EXPECT_THROW(lattice_error(si, si), std::invalid_argument);  // no valid cell at all
}

TEST(PictureError, OfPicturesOneStepApartIsTheirContrast) {
  // Truth: all values 1, exposed to 0.8 -> display 0.8^(1/2.2) = 0.903556; found: half the light
  // -> 0.4^(1/2.2) = 0.659353. MSE = 0.244203^2 -> 12.245 dB.
  const render::SphereRadiance truth = render::SphereRadiance::Ones(3, 50);
  const PictureError error = picture_error(truth, truth * 0.5);
  EXPECT_NEAR(error.psnr_db, 12.245, 5e-4);
  // Greys: L* of 0.8 and 0.4 are 91.68 and 69.47; CIEDE2000 of that step by the lightness term
  // alone: mean 80.58, S_L = 1 + 0.015 * 30.58^2/sqrt(20 + 30.58^2) = 1.4540 -> 22.22/1.4540.
  EXPECT_NEAR(error.mean_delta_e, 15.28, 0.01);
}

TEST(PictureError, OfEqualPicturesIsInfiniteDecibels) {
  const render::SphereRadiance truth = render::SphereRadiance::Ones(3, 50);
  const PictureError error = picture_error(truth, truth);
  EXPECT_EQ(error.psnr_db, std::numeric_limits<double>::infinity());
  EXPECT_EQ(error.mean_delta_e, 0.0);
}

TEST(Compare, IsTheSameWithOneThreadAndTwo) {
  const BrdfTable truth =
      table_of([](std::size_t cell) { return Rgb::Constant(0.1 + 1e-3 * double(cell % 97)); });
  const BrdfTable found =
      table_of([](std::size_t cell) { return Rgb::Constant(0.1 + 1e-3 * double(cell % 89)); });
  parallel::set_thread_count(1);
  const Comparison one = compare(truth, found);
  parallel::set_thread_count(2);
  const Comparison two = compare(truth, found);
  parallel::set_thread_count(0);
  EXPECT_EQ(one.lattice.weighted_log_rmse, two.lattice.weighted_log_rmse);
  EXPECT_EQ(one.lattice.grazing_log_bias, two.lattice.grazing_log_bias);
  EXPECT_EQ(one.lattice.raw_rmse_per_sr, two.lattice.raw_rmse_per_sr);
  EXPECT_EQ(one.lighting_a.psnr_db, two.lighting_a.psnr_db);
  EXPECT_EQ(one.lighting_b.mean_delta_e, two.lighting_b.mean_delta_e);
}

}  // namespace
}  // namespace gonio::quality
