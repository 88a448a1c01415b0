#include "gonio/design/leave_one_out.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <numeric>
#include <set>

#include "design_fixture.h"
#include "gonio/design/candidates.h"
#include "gonio/parallel/parallel.h"
#include "gonio/random/stream.h"

namespace gonio::design {
namespace {

using ::testing::Each;
using ::testing::SizeIs;

// A swap must lower J by 1e-4, and candidates are judged in single precision.
constexpr double kLeastImprovementOfJ = 2e-4;

/// A training set small enough to be fitted again without each material.
struct RefittedTraining {
  static constexpr Eigen::Index kMaterials = 5;
  static constexpr Eigen::Index kCells = 60;

  RefittedTraining() {
    const Eigen::MatrixXd x = made_up_rows(3 * kMaterials, kCells, 3).cast<double>() / 10.0;
    centred = x.rowwise() - x.colwise().mean();
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(centred * centred.transpose());
    left = eigen.eigenvectors().rightCols(3 * kMaterials - 1).rowwise().reverse();
    q = centred.transpose() * left;
    weights = Eigen::VectorXd::LinSpaced(kCells, 0.5, 2.0) / kCells;
    importance = q.transpose() * weights.asDiagonal() * q;
  }

  Eigen::MatrixXd at(const Eigen::MatrixXd& matrix, const std::vector<int>& columns) const {
    return matrix(Eigen::all, columns);
  }

  Eigen::MatrixXd centred, left, q, importance;
  Eigen::VectorXd weights;
};

const std::vector<int> kCellsChosen = {2, 11, 29, 47};

TEST(LeaveOneOut, IsTheErrorOfFitsThatHaveNotSeenTheMaterial) {
  const RefittedTraining training;
  const double eta = 0.7;
  const Eigen::MatrixXd samples = training.at(training.centred, kCellsChosen);
  const LeaveOneOut found =
      leave_one_out(training.at(training.q.transpose(), kCellsChosen).transpose(), training.left,
                    training.importance, eta);
  EXPECT_EQ(found.noise, 0.0);
  for (Eigen::Index g = 0; g < RefittedTraining::kMaterials; ++g) {
    std::vector<Eigen::Index> others;
    for (Eigen::Index i = 0; i < 3 * RefittedTraining::kMaterials; ++i) {
      if (i / 3 != g) others.push_back(i);
    }
    // Multi-output ridge regression of whole rows on their samples.
    const Eigen::MatrixXd y = samples(others, Eigen::all);
    Eigen::MatrixXd normal = y.transpose() * y;
    normal.diagonal().array() += eta;
    const Eigen::MatrixXd map =
        normal.ldlt().solve(y.transpose() * training.centred(others, Eigen::all));
    double expected = 0.0;
    for (Eigen::Index channel = 0; channel < 3; ++channel) {
      const Eigen::RowVectorXd error =
          training.centred.row(3 * g + channel) - samples.row(3 * g + channel) * map;
      expected += error.cwiseAbs2().dot(training.weights) / 3.0;
    }
    EXPECT_NEAR(found.errors[g], expected, kRounding * expected) << "material " << g;
  }
}

TEST(LeaveOneOut, CountsTheNoiseTheSamplesBring) {
  const RefittedTraining training;
  const double eta = 0.4;
  const double m = 3.0 * RefittedTraining::kMaterials;
  Eigen::VectorXd noise(4);
  noise << 0.2, 0.0, 1.5, 0.6;
  const Eigen::MatrixXd a = training.at(training.q.transpose(), kCellsChosen).transpose();
  // The solve, as one stacked least-squares problem, of samples that are noise and nothing else.
  Eigen::MatrixXd stacked(4 + a.cols(), a.cols());
  const Eigen::VectorXd trusted = ((noise.array() + eta) / m).sqrt();
  stacked << trusted.cwiseInverse().asDiagonal() * a,
      std::sqrt(m) * Eigen::MatrixXd::Identity(a.cols(), a.cols());
  const Eigen::LDLT<Eigen::MatrixXd> solver(stacked.transpose() * stacked);
  random::Stream draw(random::make_key(4, "test.leave_one_out"));
  double sum = 0.0;
  constexpr int kDraws = 20000;
  for (int i = 0; i < kDraws; ++i) {
    Eigen::VectorXd right = Eigen::VectorXd::Zero(stacked.rows());
    for (Eigen::Index j = 0; j < 4; ++j) {
      right[j] = std::sqrt(noise[j] / m) * draw.normal() / trusted[j];
    }
    const Eigen::VectorXd moved = solver.solve(stacked.transpose() * right);
    sum += moved.dot(training.importance * moved);
  }
  const LeaveOneOut found = leave_one_out(a, training.left, training.importance, eta, noise);
  EXPECT_NEAR(found.noise / (sum / kDraws), 1.0, kMonteCarlo);
  const LeaveOneOut quiet = leave_one_out(a, training.left, training.importance, eta);
  EXPECT_GT(found.errors.minCoeff(), quiet.errors.minCoeff());
}

TEST(LeaveOneOut, RefusesMatricesThatDoNotFit) {
  const RefittedTraining training;
  const Eigen::MatrixXd a = training.q.topRows(3);
  EXPECT_THROW(leave_one_out(a.leftCols(4), training.left, training.importance, 1.0),
               std::invalid_argument);
  EXPECT_THROW(leave_one_out(a, training.left.topRows(13), training.importance, 1.0),
               std::invalid_argument);
  EXPECT_THROW(leave_one_out(a, training.left, training.importance, 0.0), std::invalid_argument);
  EXPECT_THROW(leave_one_out(a, training.left, training.importance, 1.0, Eigen::VectorXd::Ones(2)),
               std::invalid_argument);
}

/// Rows over the whole lattice that vary smoothly, as a basis' do, and left vectors to go with
/// them.
struct LatticeTraining {
  static constexpr Eigen::Index kComponents = 6;

  LatticeTraining() : rows(static_cast<Eigen::Index>(basis_cell_count()), kComponents) {
    for (Eigen::Index i = 0; i < rows.rows(); ++i) {
      const brdf::HalfDiff at = direction_of_basis_cell(static_cast<std::uint32_t>(i));
      for (Eigen::Index j = 0; j < kComponents; ++j) {
        const auto order = static_cast<double>(j);
        rows(i, j) =
            static_cast<float>((std::cos((1.0 + order) * at.theta_h.radians() + 1.3 * order) +
                                std::sin((2.0 + 0.5 * order) * at.theta_d.radians()) *
                                    std::cos(2.0 * at.phi_d.radians())) /
                               (1.0 + order));
      }
    }
    const Eigen::MatrixXd tall = made_up_rows(24, kComponents, 8).cast<double>();
    const Eigen::MatrixXd centred = tall.rowwise() - tall.colwise().mean();
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(centred * centred.transpose());
    left = eigen.eigenvectors().rightCols(kComponents);
    importance = Eigen::MatrixXd::Identity(kComponents, kComponents);
    for (std::uint32_t i = 0; i < 5; ++i) start.push_back(1000 + 200000 * i);
  }

  double value_of(const std::vector<std::uint32_t>& cells, const LeaveOneOutOptions& options,
                  const Candidates& candidates = {}) const {
    Eigen::VectorXd noise;
    if (!candidates.noise.empty()) {
      noise.resize(static_cast<Eigen::Index>(cells.size()));
      for (std::size_t i = 0; i < cells.size(); ++i) {
        noise[static_cast<Eigen::Index>(i)] = static_cast<double>(candidates.noise[cells[i]]);
      }
    }
    return leave_one_out_value(
        leave_one_out(rows_of(rows, cells), left, importance, options.eta, noise), importance,
        options.floor_share);
  }

  basis::RowMajorMatrixXf rows;
  Eigen::MatrixXd left, importance;
  std::vector<std::uint32_t> start;
};

const LatticeTraining& lattice_training() {
  static const LatticeTraining training;
  return training;
}

Candidates noisy_candidates() {
  Candidates candidates;
  candidates.noise.resize(basis_cell_count());
  for (std::size_t i = 0; i < candidates.noise.size(); ++i) {
    candidates.noise[i] = 0.02F * static_cast<float>(i % 97);
  }
  return candidates;
}

/// One index away along each angle; phi_d wraps by reciprocity.
std::vector<std::uint32_t> lattice_neighbours(std::uint32_t cell) {
  namespace lattice = brdf::lattice;
  const lattice::Index at = lattice::index_from_cell(lattice::cells_above_horizon()[cell]);
  std::vector<std::uint32_t> found;
  for (const int step : {-1, 1}) {
    for (const lattice::Index& to :
         {lattice::Index{at.theta_h + step, at.theta_d, at.phi_d},
          lattice::Index{at.theta_h, at.theta_d + step, at.phi_d},
          lattice::Index{at.theta_h, at.theta_d, (at.phi_d + step + 180) % 180}}) {
      if (std::min(to.theta_h, to.theta_d) < 0 || std::max(to.theta_h, to.theta_d) >= 90) continue;
      const auto beside = basis_cell_of(lattice::angles_of(to));
      if (beside) found.push_back(*beside);
    }
  }
  return found;
}

TEST(LeaveOneOutExchange, LeavesNoSwapThatHelps) {
  const LatticeTraining& training = lattice_training();
  const Candidates candidates = noisy_candidates();
  LeaveOneOutOptions options;
  options.sweeps = 20;  // to its end
  const Design design = leave_one_out_exchange(training.rows, training.left, training.importance,
                                               candidates, training.start, options);
  ASSERT_TRUE(design.finished);
  EXPECT_NEAR(design.value, training.value_of(design.cells, options, candidates), kRounding);
  EXPECT_LT(design.value, training.value_of(training.start, options, candidates) - 0.1);
  random::Stream draw(random::make_key(3, "test.swaps"));
  for (std::size_t i = 0; i < design.cells.size(); ++i) {
    std::vector<std::uint32_t> swapped = design.cells;
    const std::vector<std::uint32_t> beside = lattice_neighbours(design.cells[i]);
    EXPECT_GE(beside.size(), 3u);
    for (const std::uint32_t to : beside) {
      if (std::count(design.cells.begin(), design.cells.end(), to) > 0) continue;
      swapped[i] = to;
      EXPECT_GT(training.value_of(swapped, options, candidates),
                design.value - kLeastImprovementOfJ);
    }
    for (int trial = 0; trial < 300; ++trial) {
      swapped[i] = static_cast<std::uint32_t>(draw.below(basis_cell_count()));
      EXPECT_GT(training.value_of(swapped, options, candidates),
                design.value - kLeastImprovementOfJ)
          << "a random cell beats the search";
    }
  }
}

TEST(LeaveOneOutExchange, ChoosesOnlyWhatTheMaskAndTheRigAllow) {
  const LatticeTraining& training = lattice_training();
  Candidates candidates;
  candidates.allowed.assign(basis_cell_count(), 0);
  std::fill(candidates.allowed.begin(), candidates.allowed.begin() + 900000, 1);
  candidates.accept = [](std::uint32_t cell) { return cell % 2 == 0; };
  const Design design = leave_one_out_exchange(training.rows, training.left, training.importance,
                                               candidates, training.start, {});
  EXPECT_GT(design.exchanges, 0);
  EXPECT_THAT(design.cells, Each(::testing::Lt(900000U)));
  for (const std::uint32_t cell : design.cells) EXPECT_EQ(cell % 2, 0U);
  EXPECT_THAT(std::set<std::uint32_t>(design.cells.begin(), design.cells.end()), SizeIs(5));
}

TEST(LeaveOneOutExchange, AvoidsWhatCostsMoreThanItBrings) {
  const LatticeTraining& training = lattice_training();
  Candidates candidates;
  candidates.penalty.assign(basis_cell_count(), 0.0F);
  std::fill(candidates.penalty.begin() + 500000, candidates.penalty.end(), 3.0F);
  const Design free = leave_one_out_exchange(training.rows, training.left, training.importance, {},
                                             training.start, {});
  ASSERT_TRUE(std::any_of(free.cells.begin(), free.cells.end(),
                          [](std::uint32_t cell) { return cell >= 500000; }));
  const Design charged = leave_one_out_exchange(training.rows, training.left, training.importance,
                                                candidates, training.start, {});
  EXPECT_THAT(charged.cells, Each(::testing::Lt(500000U)));
}

TEST(LeaveOneOutExchange, GivesTheSameSetWithOneThreadAndWithMany) {
  const LatticeTraining& training = lattice_training();
  const auto run = [&] {
    return leave_one_out_exchange(training.rows, training.left, training.importance, {},
                                  training.start, {});
  };
  parallel::set_thread_count(1);
  const Design one = run();
  parallel::set_thread_count(3);
  const Design three = run();
  parallel::set_thread_count(0);
  EXPECT_EQ(one.cells, three.cells);
  EXPECT_EQ(one.value, three.value);
}

TEST(LeaveOneOutExchange, KeepsTheBestSoFarWhenStopped) {
  const LatticeTraining& training = lattice_training();
  std::stop_source source;
  double told = 0.0;
  double fraction = 0.0;
  const Design design = leave_one_out_exchange(
      training.rows, training.left, training.importance, {}, training.start, {},
      [&](const SearchProgress& progress) {
        EXPECT_GE(progress.fraction, fraction);
        fraction = progress.fraction;
        told = progress.best;
        if (fraction > 0.1) source.request_stop();
      },
      source.get_token());
  EXPECT_FALSE(design.finished);
  EXPECT_EQ(design.value, told);
  EXPECT_NEAR(design.value, training.value_of(design.cells, {}), kRounding);
  EXPECT_LT(design.value, training.value_of(training.start, {}));
}

TEST(LeaveOneOutExchange, RefusesAStartThatIsNotAllowed) {
  const LatticeTraining& training = lattice_training();
  const auto run = [&](const std::vector<std::uint32_t>& start) {
    leave_one_out_exchange(training.rows, training.left, training.importance, {}, start, {});
  };
  EXPECT_THROW(run({}), std::invalid_argument);
  EXPECT_THROW(run({5, 5}), std::invalid_argument);
  EXPECT_THROW(run({static_cast<std::uint32_t>(basis_cell_count())}), std::invalid_argument);
}

}  // namespace
}  // namespace gonio::design
