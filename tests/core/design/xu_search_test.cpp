#include "gonio/design/xu_search.h"
#include "gonio/basis/reconstruct.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/QR>
#include <algorithm>

#include "design_fixture.h"
#include "gonio/design/criteria.h"

namespace gonio::design {
namespace {

using ::testing::Each;
using ::testing::SizeIs;

constexpr Eigen::Index kColumns = 5;

Eigen::MatrixXd some_left_vectors() {
  const Eigen::MatrixXd tall = made_up_rows(21, kColumns, 4).cast<double>();
  return Eigen::HouseholderQR<Eigen::MatrixXd>(tall).householderQ() *
         Eigen::MatrixXd::Identity(21, kColumns);
}

TEST(XuSearch, EndsWhereNoLatticeNeighbourOfTheLastIsBetter) {
  const auto rows = made_up_rows(static_cast<Eigen::Index>(basis_cell_count()), kColumns);
  const Eigen::MatrixXd left = some_left_vectors();
  Eigen::VectorXd singular(kColumns);
  singular << 300, 100, 40, 10, 5;
  ConditionSearchOptions options;
  options.sample_count = 3;
  options.random_cells = 60;
  Candidates candidates;
  candidates.accept = [](std::uint32_t cell) { return cell % 3 != 1; };
  const Design design = xu_search(rows, singular, left, candidates, options);
  ASSERT_THAT(design.cells, SizeIs(3));
  for (const std::uint32_t cell : design.cells) EXPECT_NE(cell % 3, 1U);
  EXPECT_DOUBLE_EQ(design.value,
                   xu_metric(rows_of(rows, design.cells), singular, left, basis::kPublishedEta));
  for (const std::uint32_t step : {1U, 3U}) {
    for (const std::uint32_t next : {design.cells[2] - step, design.cells[2] + step}) {
      if (next >= basis_cell_count() || next % 3 == 1) continue;
      std::vector<std::uint32_t> moved = design.cells;
      moved[2] = next;
      const brdf::HalfDiff a = direction_of_basis_cell(next);
      const brdf::HalfDiff b = direction_of_basis_cell(design.cells[2]);
      if (a.theta_d != b.theta_d || a.theta_h != b.theta_h) continue;  // the row has ended
      EXPECT_GE(xu_metric(rows_of(rows, moved), singular, left, basis::kPublishedEta),
                design.value * 0.999999);
    }
  }
  // Thirty random triples: none is better than what a search of sixty cells each has found.
  for (std::uint32_t i = 0; i < 30; ++i) {
    EXPECT_GT(xu_metric(rows_of(rows, {1000 + i, 400000 + 7 * i, 900000 + 31 * i}), singular, left,
                        basis::kPublishedEta),
              design.value);
  }
}

TEST(XuSearch, RefusesVectorsThatDoNotFit) {
  const auto rows = made_up_rows(static_cast<Eigen::Index>(basis_cell_count()), 2);
  EXPECT_THROW(xu_search(rows, Eigen::VectorXd::Ones(1), Eigen::MatrixXd::Ones(6, 2), {}, {}),
               std::invalid_argument);
  EXPECT_THROW(
      xu_search(rows.topRows(9), Eigen::VectorXd::Ones(2), Eigen::MatrixXd::Ones(6, 2), {}, {}),
      std::invalid_argument);
}

}  // namespace
}  // namespace gonio::design
