#include "gonio/brdf/brdf_table.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>
#include <stdexcept>
#include <vector>

#include "gonio/errors/errors.h"
#include "gonio/parallel/parallel.h"

namespace gonio::brdf {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

TEST(BrdfTable, StartsWithoutAValidCell) {
  const BrdfTable table;
  EXPECT_FALSE(table.valid(0));
  EXPECT_FALSE(table.valid(lattice::kCells - 1));
  EXPECT_TRUE(table.value(0).isNaN().all());
  EXPECT_EQ(table.stored_planes().front(), -1.0);
  EXPECT_EQ(table.scale(), RadiometricScale::si);
  EXPECT_EQ(table.convention(), IndexConvention::bin_centre);
}

TEST(BrdfTable, ReturnsWhatWasSetWithinOneUlp) {
  BrdfTable table;
  std::mt19937_64 generator(11);
  std::uniform_real_distribution<double> exponent(-12.0, 6.0);
  for (std::size_t cell = 0; cell < 100'000; ++cell) {
    const Rgb set(std::pow(10.0, exponent(generator)), std::pow(10.0, exponent(generator)),
                  std::pow(10.0, exponent(generator)));
    table.set_value(cell, set);
    const Rgb found = table.value(cell);
    for (int channel = 0; channel < 3; ++channel) {
      ASSERT_LE(found[channel], std::nextafter(set[channel], kInfinity));
      ASSERT_GE(found[channel], std::nextafter(set[channel], 0.0));
    }
  }
}

TEST(BrdfTable, StoresInMerlUnits) {
  BrdfTable table;
  table.set_value(5, {1.0, 1.15, 1.66});
  for (std::size_t channel = 0; channel < 3; ++channel) {
    EXPECT_NEAR(table.stored_planes()[5 + channel * lattice::kCells], 1500.0, 1e-9);
  }
}

TEST(BrdfTable, ClampsNegativesAndRefusesWhatIsNotFinite) {
  BrdfTable table;
  table.set_value(7, {-0.5, -0.0, 2.0});
  EXPECT_TRUE(table.valid(7));
  EXPECT_EQ(table.value(7)[0], 0.0);
  EXPECT_FALSE(std::signbit(table.stored_planes()[7 + lattice::kCells]));
  EXPECT_THROW(table.set_value(8, {0.1, kNan, 0.1}), std::invalid_argument);
  EXPECT_THROW(table.set_value(8, {kInfinity, 0.1, 0.1}), std::invalid_argument);
  EXPECT_FALSE(table.valid(8));
}

TEST(BrdfTable, CallsACellInvalidWhenAnyChannelIs) {
  for (std::size_t channel = 0; channel < 3; ++channel) {
    std::vector<double> planes(3 * lattice::kCells, 1.0);
    planes[channel * lattice::kCells + 3] = -1e-9;
    planes[channel * lattice::kCells + 4] = kNan;
    const BrdfTable table(std::move(planes), IndexConvention::dtu, RadiometricScale::merl);
    EXPECT_TRUE(table.valid(2));
    EXPECT_FALSE(table.valid(3));
    EXPECT_FALSE(table.valid(4));
    EXPECT_TRUE(table.value(3).isNaN().all());
  }
}

TEST(BrdfTable, KeepsTheNumbersItWasGiven) {
  std::vector<double> planes(3 * lattice::kCells);
  for (std::size_t i = 0; i < planes.size(); ++i) planes[i] = 0.1 * static_cast<double>(i) - 7.0;
  const std::vector<double> copy = planes;
  const BrdfTable table(std::move(planes), IndexConvention::left_edge, RadiometricScale::merl);
  EXPECT_EQ(table.stored_planes(), copy);
}

TEST(BrdfTable, ForgetsACellSetInvalid) {
  BrdfTable table;
  table.set_value(9, {0.1, 0.2, 0.3});
  table.set_invalid(9);
  EXPECT_FALSE(table.valid(9));
}

TEST(BrdfTable, RefusesPlanesOfAnotherSize) {
  EXPECT_THROW(
      BrdfTable(std::vector<double>(12), IndexConvention::bin_centre, RadiometricScale::si),
      std::invalid_argument);
}

TEST(RadiometricScales, ReadBackTheirNamesAndRefuseOthers) {
  for (const auto scale : {RadiometricScale::si, RadiometricScale::merl}) {
    EXPECT_EQ(radiometric_scale_from_string(to_string(scale)), scale);
  }
  EXPECT_THROW(radiometric_scale_from_string("SI"), std::invalid_argument);
}

/// Says what it was asked: the heights of light and detector, and which side the light is on.
class Probe final : public BrdfModel {
 public:
  Rgb evaluate(const DirectionPair& pair) const override {
    return {pair.wi.z(), pair.wo.z(), 2.0 + pair.wi.y()};
  }
};

TEST(Tabulate, EvaluatesEachCellAtItsOwnDirections) {
  for (const auto convention :
       {IndexConvention::left_edge, IndexConvention::bin_centre, IndexConvention::dtu}) {
    const BrdfTable table = tabulate(Probe(), RadiometricScale::si, convention);
    const auto& mask = lattice::above_horizon_mask(convention);
    for (std::size_t cell = 0; cell < lattice::kCells; cell += 613) {
      ASSERT_EQ(table.valid(cell), mask[cell] != 0);
      if (mask[cell] == 0) continue;
      const DirectionPair at =
          directions_from_half_diff(lattice::angles_of(lattice::index_from_cell(cell), convention));
      const Rgb found = table.value(cell);
      ASSERT_NEAR(found[0], at.wi.z(), 1e-14);
      ASSERT_NEAR(found[1], at.wo.z(), 1e-14);
      ASSERT_NEAR(found[2], 2.0 + at.wi.y(), 1e-14);
    }
  }
}

TEST(Tabulate, GivesTheSameBytesWithOneThreadAndWithTwo) {
  parallel::set_thread_count(1);
  const BrdfTable one = tabulate(Probe(), RadiometricScale::si);
  parallel::set_thread_count(2);
  const BrdfTable two = tabulate(Probe(), RadiometricScale::si);
  parallel::set_thread_count(0);
  EXPECT_EQ(one.stored_planes(), two.stored_planes());
}

TEST(ValuesAtCells, AreThreePlanesInTheOrderOfTheCells) {
  const std::vector<std::uint32_t> cells = {40'000, 12, 700'123};
  const std::vector<double> planes = values_at_cells(Probe(), cells);
  const BrdfTable table = tabulate(Probe(), RadiometricScale::si);
  const std::vector<double> from_table = values_at_cells(table, cells);
  ASSERT_EQ(planes.size(), 9u);
  ASSERT_EQ(from_table.size(), 9u);
  for (std::size_t i = 0; i < cells.size(); ++i) {
    for (std::size_t channel = 0; channel < 3; ++channel) {
      const double expected = table.value(cells[i])[static_cast<Eigen::Index>(channel)];
      EXPECT_NEAR(planes[channel * 3 + i], expected, 1e-14);
      EXPECT_EQ(from_table[channel * 3 + i], expected);
    }
  }
}

TEST(ValuesAtCells, AreNanWhereATableIsInvalid) {
  BrdfTable table;
  table.set_value(4, {0.1, 0.2, 0.3});
  const std::vector<double> planes = values_at_cells(table, std::vector<std::uint32_t>{3, 4});
  EXPECT_TRUE(std::isnan(planes[0]));
  EXPECT_EQ(planes[1], table.value(4)[0]);
}

TEST(ValuesAtCells, RefuseACellThatIsNotOnTheLattice) {
  const std::vector<std::uint32_t> cells = {0, static_cast<std::uint32_t>(lattice::kCells)};
  EXPECT_THROW(values_at_cells(Probe(), cells), std::invalid_argument);
  EXPECT_THROW(values_at_cells(BrdfTable(), cells), std::invalid_argument);
}

/// Infinite close to the normal only, where the first cells are.
class Singular final : public BrdfModel {
 public:
  Rgb evaluate(const DirectionPair& pair) const override {
    return Rgb::Constant(pair.wi.z() > 0.9999 ? kInfinity : 1.0);
  }
};

TEST(Tabulate, NamesTheAnglesWhereAModelIsNotFinite) {
  try {
    tabulate(Singular(), RadiometricScale::si);
    FAIL() << "an infinite value went into a table";
  } catch (const NumericalError& error) {
    EXPECT_THAT(error.what(), ::testing::HasSubstr("theta_h 0.002778, theta_d 0.5, phi_d 0.5 deg"));
  }
}

}  // namespace
}  // namespace gonio::brdf
