// What needs the whole lattice: weights, candidate cells, the published search and sets.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <set>

#include "design_fixture.h"
#include "gonio/basis/training_set.h"
#include "gonio/brdf/builtin_materials.h"
#include "gonio/brdf/merl_lattice.h"
#include "gonio/design/candidates.h"
#include "gonio/design/condition_search.h"
#include "gonio/design/criteria.h"
#include "gonio/design/importance.h"
#include "gonio/design/published_sets.h"
#include "gonio/parallel/parallel.h"

namespace gonio::design {
namespace {

using ::testing::HasSubstr;
using ::testing::SizeIs;
using ::testing::ThrowsMessage;

constexpr double kWeightSum = 1e-4;  // a million single-precision weights

TEST(ImportanceWeights, SumToOneWhateverTheBlend) {
  for (const double blend : {0.0, 0.1, 1.0}) {
    const Eigen::VectorXf weights = importance_weights({blend});
    EXPECT_EQ(static_cast<std::size_t>(weights.size()), basis_cell_count());
    EXPECT_NEAR(weights.cast<double>().sum(), 1.0, kWeightSum);
    EXPECT_GE(weights.minCoeff(), 0.0F);
  }
}

TEST(ImportanceWeights, BlendIsTheShareOfTheUniformPart) {
  const Eigen::VectorXf weights = importance_weights({0.25});
  const double uniform = 0.25 / static_cast<double>(weights.size());
  EXPECT_NEAR(weights.minCoeff(), uniform, 1e-3 * uniform);  // cells at the horizon have the rest 0
  EXPECT_GT(weights.maxCoeff(), 4.0 * uniform);
  EXPECT_THROW(importance_weights({1.5}), std::invalid_argument);
  EXPECT_THROW(importance_weights({std::nan("")}), std::invalid_argument);
}

TEST(ImportanceMatrix, IsTheWeightedMeanSquareOfAnError) {
  const auto rows = made_up_rows(20000, 3);
  Eigen::VectorXf weights = Eigen::VectorXf::LinSpaced(20000, 0.0F, 1e-4F);
  const Eigen::MatrixXd importance = importance_matrix(rows, weights);
  const Eigen::Vector3d error(0.3, -1.0, 2.0);
  double expected = 0.0;
  for (Eigen::Index i = 0; i < 20000; ++i) {
    const double x = rows.row(i).cast<double>().dot(error);
    expected += static_cast<double>(weights[i]) * x * x;
  }
  EXPECT_NEAR(error.dot(importance * error) / expected, 1.0, 1e-5);  // single-precision products
  EXPECT_THROW(importance_matrix(rows, weights.head(5)), std::invalid_argument);
}

TEST(Candidates, EveryBasisCellFindsItsWayBack) {
  for (const std::uint32_t cell : {0u, 17u, 555555u, 1096215u}) {
    EXPECT_EQ(basis_cell_of(direction_of_basis_cell(cell)), cell);
  }
}

TEST(Candidates, LimitsHoldForEveryCellThatPasses) {
  DirectionLimits limits;
  limits.theta_i_max = Angle::from_degrees(70.0);
  limits.theta_o_max = Angle::from_degrees(60.0);
  limits.theta_d_min = Angle::from_degrees(5.0);
  const std::vector<std::uint8_t> mask = cells_within(limits);
  std::size_t passed = 0;
  for (std::size_t i = 0; i < mask.size(); i += 7) {
    if (mask[i] == 0) continue;
    ++passed;
    const brdf::HalfDiff at = direction_of_basis_cell(static_cast<std::uint32_t>(i));
    const brdf::DirectionPair pair = brdf::directions_from_half_diff(at);
    ASSERT_LE(std::acos(pair.wi.z()) * 180.0 / 3.14159265358979, 70.0 + 1e-6);
    ASSERT_LE(std::acos(pair.wo.z()) * 180.0 / 3.14159265358979, 60.0 + 1e-6);
    ASSERT_GE(at.theta_d.degrees(), 5.0);
  }
  EXPECT_GT(passed, 20000u);
}

TEST(Candidates, LatticeMaskKeepsItsCells) {
  std::vector<std::uint8_t> lattice_mask(brdf::lattice::kCells, 0);
  lattice_mask[brdf::lattice::cells_above_horizon()[1234]] = 1;
  const std::vector<std::uint8_t> mask = basis_mask(lattice_mask);
  EXPECT_EQ(std::accumulate(mask.begin(), mask.end(), 0), 1);
  EXPECT_EQ(mask[1234], 1);
  EXPECT_THROW(basis_mask(std::vector<std::uint8_t>(5)), std::invalid_argument);
}

TEST(PublishedSets, AreAllThereAndAboveTheHorizonButForOne) {
  std::set<std::string_view> names;
  int below = 0;
  for (const PublishedSet& set : published_sets()) {
    EXPECT_TRUE(names.insert(set.name).second);
    EXPECT_FALSE(set.source.empty());
    for (const brdf::HalfDiff& at : set.directions) {
      if (!brdf::above_horizon(at.theta_h, at.theta_d, at.phi_d)) ++below;
    }
  }
  EXPECT_EQ(below, 1);
  EXPECT_THAT(published_set("nielsen-10").directions, SizeIs(10));
  EXPECT_THAT(published_set("seed-report-10").directions, SizeIs(10));
  EXPECT_THAT(published_set("dtu-5").directions, SizeIs(5));
  EXPECT_THAT([] { published_set("nielsen"); },
              ThrowsMessage<std::invalid_argument>(HasSubstr("nielsen-10")));
}

/// A basis that varies smoothly over the lattice, as real ones do.
basis::RowMajorMatrixXf smooth_rows() {
  const auto cells = static_cast<Eigen::Index>(basis_cell_count());
  basis::RowMajorMatrixXf rows(cells, 4);
  for (Eigen::Index i = 0; i < cells; ++i) {
    const brdf::HalfDiff at = direction_of_basis_cell(static_cast<std::uint32_t>(i));
    const double h = at.theta_h.radians();
    const double d = at.theta_d.radians();
    rows.row(i) << static_cast<float>(9.0 * std::exp(-30.0 * h * h)),
        static_cast<float>(4.0 * std::cos(d)),
        static_cast<float>(3.0 * std::sin(2.0 * d) * std::sin(h)),
        static_cast<float>(std::sin(h) * std::cos(at.phi_d.radians()));
  }
  return rows;
}

TEST(ConditionSearch, StartsAtTheLargestRowAndBeatsChance) {
  const basis::RowMajorMatrixXf rows = smooth_rows();
  Candidates candidates;
  candidates.allowed = cells_within({});
  ConditionSearchOptions options;
  options.sample_count = 4;
  const Design design = condition_search(rows, candidates, options);
  ASSERT_THAT(design.cells, SizeIs(4));
  float largest = 0.0F;
  for (std::size_t i = 0; i < candidates.allowed.size(); ++i) {
    if (candidates.allowed[i])
      largest = std::max(largest, rows.row(static_cast<Eigen::Index>(i)).norm());
  }
  EXPECT_FLOAT_EQ(rows.row(design.cells[0]).norm(), largest);
  for (const std::uint32_t cell : design.cells) EXPECT_EQ(candidates.allowed[cell], 1);
  EXPECT_NEAR(design.value, condition_number(rows_of(rows, design.cells)), 1e-9 * design.value);

  const random::Key key = random::make_key(4, "test.chance");
  std::vector<double> chance;
  for (std::uint64_t draw = 0; draw < 99; ++draw) {
    std::vector<std::uint32_t> cells(design.cells.begin(), design.cells.begin() + 1);
    for (std::uint64_t i = 0; i < 3; ++i) {
      cells.push_back(static_cast<std::uint32_t>(random::uniform(key, 3 * draw + i) * 1096216.0));
    }
    chance.push_back(condition_number(rows_of(rows, cells)));
  }
  std::sort(chance.begin(), chance.end());
  EXPECT_LT(design.value, chance.front());
}

TEST(ConditionSearch, IsAtRestUnderSingleSteps) {
  const basis::RowMajorMatrixXf rows = smooth_rows();
  ConditionSearchOptions options;
  options.sample_count = 3;
  const Design design = condition_search(rows, {}, options);
  const auto& cells = brdf::lattice::cells_above_horizon();
  const brdf::lattice::Index at = brdf::lattice::index_from_cell(cells[design.cells[2]]);
  for (const int step : {-1, 1}) {
    if (at.theta_d + step < 0 || at.theta_d + step > 89) continue;
    const auto moved =
        basis_cell_of(brdf::lattice::angles_of({at.theta_h, at.theta_d + step, at.phi_d}));
    if (!moved) continue;
    EXPECT_GE(condition_number(rows_of(rows, {design.cells[0], design.cells[1], *moved})),
              design.value * (1.0 - 1e-9));
  }
}

TEST(ConditionSearch, GivesTheSameSetForTheSameSeedOnly) {
  const basis::RowMajorMatrixXf rows = smooth_rows();
  ConditionSearchOptions options;
  options.sample_count = 3;
  const Design first = condition_search(rows, {}, options);
  EXPECT_EQ(first.cells, condition_search(rows, {}, options).cells);
  options.seed = 2;
  EXPECT_NE(first.cells, condition_search(rows, {}, options).cells);
}

TEST(ConditionSearch, AsksTheRigAndKeepsAWholeSetWhenStopped) {
  const basis::RowMajorMatrixXf rows = smooth_rows();
  Candidates candidates;
  candidates.accept = [](std::uint32_t cell) { return cell % 2 == 0; };
  std::stop_source source;
  source.request_stop();
  ConditionSearchOptions options;
  options.sample_count = 6;  // more samples than components
  const Design design = condition_search(rows, candidates, options, {}, source.get_token());
  EXPECT_FALSE(design.finished);
  ASSERT_THAT(design.cells, SizeIs(6));
  for (const std::uint32_t cell : design.cells) EXPECT_EQ(cell % 2, 0u);
}

TEST(ConditionSearch, RefusesWhatItCannotDo) {
  const basis::RowMajorMatrixXf rows = smooth_rows();
  ConditionSearchOptions options;
  options.sample_count = 0;
  EXPECT_THROW(condition_search(rows, {}, options), std::invalid_argument);
  options.sample_count = 4;
  EXPECT_THROW(condition_search(rows.topRows(50), {}, options), std::invalid_argument);
  Candidates nothing;
  nothing.allowed.assign(basis_cell_count(), 0);
  EXPECT_THAT([&] { condition_search(rows, nothing, options); },
              ThrowsMessage<std::invalid_argument>(HasSubstr("only 0 usable")));
}

}  // namespace
}  // namespace gonio::design
