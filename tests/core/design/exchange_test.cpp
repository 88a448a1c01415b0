#include "gonio/design/exchange.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <thread>

#include "design_fixture.h"
#include "gonio/parallel/parallel.h"
#include "wavy_basis.h"

namespace gonio::design {
namespace {

using ::testing::AllOf;
using ::testing::Each;
using ::testing::Ge;
using ::testing::HasSubstr;
using ::testing::Lt;
using ::testing::SizeIs;
using ::testing::ThrowsMessage;

// A swap must gain a millionth of the criterion to be taken (single precision of the candidates'
// figures), so a fixpoint may miss that much and a little rounding.
constexpr double kCellFixpoint = 3e-6;
constexpr double kEta = 0.3;

Eigen::MatrixXd importance_of(const basis::RowMajorMatrixXf& rows) {
  const Eigen::MatrixXd q = rows.cast<double>();
  return q.transpose() * q / static_cast<double>(rows.rows());
}

ExchangeOptions options_for(int samples, Criterion criterion = Criterion::bayes_a) {
  ExchangeOptions options;
  options.sample_count = samples;
  options.criterion = criterion;
  options.eta = kEta;
  return options;
}

class ExchangeCriteria : public ::testing::TestWithParam<Criterion> {};
INSTANTIATE_TEST_SUITE_P(All, ExchangeCriteria,
                         ::testing::Values(Criterion::bayes_a, Criterion::xu_squared,
                                           Criterion::bayes_d),
                         [](const auto& parameter) {
                           switch (parameter.param) {
                             case Criterion::bayes_a:
                               return "BayesA";
                             case Criterion::xu_squared:
                               return "XuSquared";
                             default:
                               return "BayesD";
                           }
                         });

TEST_P(ExchangeCriteria, FindsTheBestTripleOfAll) {
  const auto rows = made_up_rows(24, 4);
  const Eigen::MatrixXd importance = importance_of(rows);
  double least = 1e300;
  for (std::uint32_t a = 0; a < 24; ++a) {
    for (std::uint32_t b = a + 1; b < 24; ++b) {
      for (std::uint32_t c = b + 1; c < 24; ++c) {
        least = std::min(least,
                         criterion_value(GetParam(), rows_of(rows, {a, b, c}), importance, kEta));
      }
    }
  }
  const Design design = exchange(rows, importance, {}, options_for(3, GetParam()));
  EXPECT_NEAR(design.value, least, kCellFixpoint * std::abs(least));
  EXPECT_TRUE(design.finished);
}

// Weighted least squares: a sample's row counts for as much as its noise allows.
TEST_P(ExchangeCriteria, FindsTheBestTripleOfNoisyAndCostlyCells) {
  const auto rows = made_up_rows(24, 4);
  const Eigen::MatrixXd importance = importance_of(rows);
  Candidates candidates;
  for (std::uint32_t cell = 0; cell < 24; ++cell) {
    candidates.noise.push_back(static_cast<float>(cell % 5) * 20.0F);
    candidates.penalty.push_back(static_cast<float>(cell % 7) * 0.15F);
  }
  double least = 1e300;
  for (std::uint32_t a = 0; a < 24; ++a) {
    for (std::uint32_t b = a + 1; b < 24; ++b) {
      for (std::uint32_t c = b + 1; c < 24; ++c) {
        Eigen::MatrixXd weighed = rows_of(rows, {a, b, c});
        double cost = 0.0;
        Eigen::Index at = 0;
        for (const std::uint32_t cell : {a, b, c}) {
          weighed.row(at++) /= std::sqrt(kEta + static_cast<double>(candidates.noise[cell]));
          cost += static_cast<double>(candidates.penalty[cell]);
        }
        const double value = criterion_value(GetParam(), weighed, importance, 1.0);
        least = std::min(least,
                         GetParam() == Criterion::bayes_d ? value + cost : value * std::exp(cost));
      }
    }
  }
  const Design design = exchange(rows, importance, candidates, options_for(3, GetParam()));
  EXPECT_NEAR(design.value, least, kCellFixpoint * std::abs(least));
  const Design blind = exchange(rows, importance, {}, options_for(3, GetParam()));
  EXPECT_NE(design.cells, blind.cells);
}

TEST(Exchange, RefusesNoiseThatIsNotANumber) {
  const auto rows = made_up_rows(40, 6);
  Candidates candidates;
  candidates.noise.assign(40, std::nanf(""));
  EXPECT_THROW(exchange(rows, importance_of(rows), candidates, options_for(3)),
               std::invalid_argument);
  candidates.noise.clear();
  candidates.penalty.assign(39, 0.0F);
  EXPECT_THROW(exchange(rows, importance_of(rows), candidates, options_for(3)),
               std::invalid_argument);
}

TEST_P(ExchangeCriteria, LeavesNoSwapThatHelps) {
  // More cells than the starts look at: the last word is spoken over all of them.
  const auto rows = made_up_rows(5000, 6);
  const Eigen::MatrixXd importance = importance_of(rows);
  ExchangeOptions options = options_for(7, GetParam());  // more samples than components
  options.start_candidates = 300;
  const Design design = exchange(rows, importance, {}, options);
  ASSERT_THAT(design.cells, SizeIs(7));
  for (std::size_t i = 0; i < 7; ++i) {
    std::vector<std::uint32_t> swapped = design.cells;
    for (std::uint32_t cell = 0; cell < 5000; ++cell) {
      if (std::find(design.cells.begin(), design.cells.end(), cell) != design.cells.end()) continue;
      swapped[i] = cell;
      ASSERT_GT(criterion_value(GetParam(), rows_of(rows, swapped), importance, kEta),
                design.value - kCellFixpoint * std::abs(design.value))
          << "sample " << i << " would better be cell " << cell;
    }
  }
}

// The whole lattice is first searched around each sample, then everywhere.
TEST(Exchange, EndsWhereNoCellOfTheLatticeIsBetter) {
  const basis::RowMajorMatrixXf& rows = wavy_basis().components;
  Candidates candidates;
  candidates.allowed.assign(static_cast<std::size_t>(rows.rows()), 1);
  std::fill(candidates.allowed.begin() + 300000, candidates.allowed.begin() + 600000, 0);
  ExchangeOptions options = options_for(5);
  options.starts = 2;
  const Design design = exchange(rows, importance(), candidates, options);
  ASSERT_THAT(design.cells, SizeIs(5));
  for (const std::uint32_t cell : design.cells) EXPECT_EQ(candidates.allowed[cell], 1);
  for (std::size_t i = 0; i < design.cells.size(); ++i) {
    std::vector<std::uint32_t> swapped = design.cells;
    for (std::uint32_t cell = static_cast<std::uint32_t>(i); cell < 1096216; cell += 173) {
      if (candidates.allowed[cell] == 0) continue;
      swapped[i] = cell;
      ASSERT_GT(criterion_value(Criterion::bayes_a, rows_of(rows, swapped), importance(), kEta),
                design.value * (1.0 - kCellFixpoint));
    }
  }
}

TEST(Exchange, ReportsTheCriterionOfWhatItChose) {
  const auto rows = made_up_rows(500, 6);
  const Eigen::MatrixXd importance = importance_of(rows);
  const Design design = exchange(rows, importance, {}, options_for(4));
  EXPECT_DOUBLE_EQ(design.value, criterion_value(Criterion::bayes_a, rows_of(rows, design.cells),
                                                 importance, kEta));
  EXPECT_THAT(std::set<std::uint32_t>(design.cells.begin(), design.cells.end()), SizeIs(4));
  EXPECT_EQ(design.starts, ExchangeOptions().starts);
}

TEST(Exchange, ChoosesOnlyWhatTheMaskAndTheRigAllow) {
  const auto rows = made_up_rows(3000, 6);
  Candidates candidates;
  candidates.allowed.assign(3000, 0);
  std::fill(candidates.allowed.begin() + 1000, candidates.allowed.begin() + 2000, 1);
  std::set<std::uint32_t> asked;
  candidates.accept = [&](std::uint32_t cell) {
    EXPECT_TRUE(asked.insert(cell).second) << "asked twice about " << cell;
    return cell % 3 == 0;
  };
  const Design design = exchange(rows, importance_of(rows), candidates, options_for(8));
  EXPECT_THAT(design.cells, Each(AllOf(Ge(1000u), Lt(2000u))));
  for (const std::uint32_t cell : design.cells) EXPECT_EQ(cell % 3, 0u);
  EXPECT_LT(asked.size(), 900u) << "asks lazily, not about every cell";
}

TEST(Exchange, FindsTheFewCellsARigCanReach) {
  const auto rows = made_up_rows(4000, 6);
  Candidates candidates;
  candidates.accept = [](std::uint32_t cell) { return cell % 800 == 799; };  // 5 of 4000
  ExchangeOptions options = options_for(5);
  options.start_candidates = 80;
  Design design = exchange(rows, importance_of(rows), candidates, options);
  std::sort(design.cells.begin(), design.cells.end());
  EXPECT_THAT(design.cells, ::testing::ElementsAre(799, 1599, 2399, 3199, 3999));
}

TEST(Exchange, SaysHowManyCandidatesThereAreWhenTooFew) {
  const auto rows = made_up_rows(4000, 6);
  Candidates candidates;
  candidates.accept = [](std::uint32_t cell) { return cell < 3; };
  EXPECT_THAT([&] { exchange(rows, importance_of(rows), candidates, options_for(4)); },
              ThrowsMessage<std::invalid_argument>(HasSubstr("only 3 usable candidates for 4")));
}

TEST(Exchange, RefusesShapesAndOptionsThatDoNotFit) {
  const auto rows = made_up_rows(40, 6);
  const Eigen::MatrixXd importance = importance_of(rows);
  EXPECT_THROW(exchange(rows, Eigen::MatrixXd::Identity(5, 5), {}, options_for(3)),
               std::invalid_argument);
  Candidates short_mask;
  short_mask.allowed.assign(39, 1);
  EXPECT_THROW(exchange(rows, importance, short_mask, options_for(3)), std::invalid_argument);
  EXPECT_THROW(exchange(rows, importance, {}, options_for(0)), std::invalid_argument);
  ExchangeOptions options = options_for(3);
  options.eta = 0.0;
  EXPECT_THROW(exchange(rows, importance, {}, options), std::invalid_argument);
}

TEST(Exchange, GivesTheSameSetWithOneThreadAndWithMany) {
  const auto rows = made_up_rows(20000, 8);
  const Eigen::MatrixXd importance = importance_of(rows);
  parallel::set_thread_count(1);
  const Design one = exchange(rows, importance, {}, options_for(6));
  parallel::set_thread_count(3);
  const Design three = exchange(rows, importance, {}, options_for(6));
  parallel::set_thread_count(0);
  EXPECT_EQ(one.cells, three.cells);
  EXPECT_EQ(one.value, three.value);
}

TEST(Exchange, KeepsAWholeDesignWhenAskedToStopAtOnce) {
  const auto rows = made_up_rows(5000, 8);
  std::stop_source source;
  source.request_stop();
  const Design design =
      exchange(rows, importance_of(rows), {}, options_for(6), {}, source.get_token());
  EXPECT_FALSE(design.finished);
  EXPECT_THAT(design.cells, SizeIs(6));
}

TEST(Exchange, StopsInTheMiddleWithTheBestSoFar) {
  const auto rows = made_up_rows(5000, 8);
  std::stop_source source;
  double told = 0.0;
  int calls = 0;
  const Design design = exchange(
      rows, importance_of(rows), {}, options_for(6),
      [&](const SearchProgress& progress) {
        told = progress.best;
        if (++calls == 9) source.request_stop();
      },
      source.get_token());
  EXPECT_EQ(calls, 9);
  EXPECT_FALSE(design.finished);
  EXPECT_DOUBLE_EQ(design.value, told);
}

TEST(Exchange, TellsProgressThatNeverFalls) {
  const auto rows = made_up_rows(3000, 8);
  double fraction = 0.0;
  double best = 1e300;
  exchange(rows, importance_of(rows), {}, options_for(6), [&](const SearchProgress& progress) {
    EXPECT_GE(progress.fraction, fraction);
    EXPECT_LE(progress.fraction, 1.0);
    EXPECT_LE(progress.best, best);
    fraction = progress.fraction;
    best = progress.best;
  });
  EXPECT_EQ(fraction, 1.0);
}

}  // namespace
}  // namespace gonio::design
