#include "gonio/quality/forecast.h"

#include <gtest/gtest.h>

#include <cmath>

#include "gonio/brdf/merl_lattice.h"
#include "gonio/parallel/parallel.h"

namespace gonio::quality {
namespace {

/// Grey materials of three brightnesses, one component: brighter.
basis::Basis greys() {
  basis::Basis basis;
  basis.materials = {{"a", "", ""}, {"b", "", ""}, {"c", "", ""}};
  const auto p = static_cast<Eigen::Index>(brdf::lattice::cells_above_horizon().size());
  basis.mean.resize(p);
  for (Eigen::Index i = 0; i < p; ++i) {
    const brdf::HalfDiff at = brdf::lattice::angles_of(brdf::lattice::index_from_cell(
        brdf::lattice::cells_above_horizon()[static_cast<std::size_t>(i)]));
    const double weight =
        basis.mapping.weight(brdf::polar_cosines(at.theta_h, at.theta_d, at.phi_d));
    basis.mean[i] = static_cast<float>(basis.mapping.forward(0.3, weight));
  }
  basis.components = basis::RowMajorMatrixXf::Ones(p, 1);
  basis.left_vectors.resize(9, 1);
  basis.left_vectors << -0.4, -0.4, -0.4, 0, 0, 0, 0.4, 0.4, 0.4;
  return basis;
}

TEST(Forecast, IsHighForPerfectPredictionsAndFallsWithTheError) {
  const basis::Basis basis = greys();
  const Eigen::MatrixXd nothing = Eigen::MatrixXd::Zero(9, 1);
  EXPECT_GT(forecast(basis, nothing).psnr_db, 90.0);
  // Everything brighter by 2 %: display values of v become v 1.02^(1/2.2), about 0.009 v more, and
  // most v lie between 0.5 and 0.9: 42 to 47 dB.
  const Forecast slight = forecast(basis, nothing.array() - 0.02);
  EXPECT_GT(slight.psnr_db, 41.0);
  EXPECT_LT(slight.psnr_db, 48.0);
  const Forecast ten_times = forecast(basis, nothing.array() - 0.2);
  EXPECT_NEAR(slight.psnr_db - ten_times.psnr_db, 20.0, 2.0);
}

TEST(Forecast, SaysHowMuchMaterialsDiffer) {
  const basis::Basis basis = greys();
  Eigen::MatrixXd residuals = Eigen::MatrixXd::Constant(9, 1, 0.01);
  EXPECT_LT(forecast(basis, residuals).standard_error_db, 0.05);
  residuals.topRows(3).setConstant(0.3);
  const Forecast uneven = forecast(basis, residuals);
  EXPECT_GT(uneven.standard_error_db, 3.0);
  EXPECT_LT(uneven.tenth_percentile_db, uneven.psnr_db - 5.0);
}

TEST(Forecast, GivesTheSameFiguresForAnyNumberOfThreads) {
  const basis::Basis basis = greys();
  const Eigen::MatrixXd residuals = Eigen::MatrixXd::Constant(9, 1, 0.03);
  parallel::set_thread_count(1);
  const double one = forecast(basis, residuals).psnr_db;
  parallel::set_thread_count(3);
  EXPECT_EQ(forecast(basis, residuals).psnr_db, one);
  parallel::set_thread_count(0);
  EXPECT_THROW(forecast(basis, residuals.topRows(6)), std::invalid_argument);
}

}  // namespace
}  // namespace gonio::quality
