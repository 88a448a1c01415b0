#include <gtest/gtest.h>

#include <Eigen/LU>
#include <Eigen/QR>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>

#include "gonio/basis/reconstruct.h"
#include "test_materials.h"

namespace gonio::basis {
namespace {

/// The method as published: median reference row, dense SVD, ridge on the first n scaled
/// directions, eta = 40 (Nielsen, Jensen, Ramamoorthi, ACM TOG 34(6) 2015, eqs. 3 to 6), in double
/// precision and sharing nothing with the library but the lattice.
class Published {
 public:
  explicit Published(int materials) {
    const auto& cells = brdf::lattice::cells_above_horizon();
    const Eigen::Index p = static_cast<Eigen::Index>(cells.size());
    Eigen::MatrixXd x(p, 3 * materials);  // rho w
    weight_.resize(p);
    for (Eigen::Index i = 0; i < p; ++i) {
      const brdf::ShadingGeometry at = brdf::shading_geometry(brdf::lattice::angles_of(
          brdf::lattice::index_from_cell(cells[static_cast<std::size_t>(i)])));
      weight_[i] = std::min(std::max(at.cos_theta_i * at.cos_theta_o, 0.01), 1.0);
      for (int material = 0; material < materials; ++material) {
        const brdf::Rgb rho = test::material(material).evaluate(at);
        for (int c = 0; c < 3; ++c) x(i, 3 * material + c) = rho[c] * weight_[i];
      }
    }
    reference_.resize(p);
    std::vector<double> row(static_cast<std::size_t>(x.cols()));
    for (Eigen::Index i = 0; i < p; ++i) {
      for (Eigen::Index j = 0; j < x.cols(); ++j) row[static_cast<std::size_t>(j)] = x(i, j);
      std::sort(row.begin(), row.end());
      reference_[i] = 0.5 * (row[row.size() / 2 - 1] + row[row.size() / 2]);
      x.row(i) = ((x.row(i).array() + kEps) / (reference_[i] + kEps)).log();
    }
    mean_ = x.rowwise().mean();
    x.colwise() -= mean_;
    // X = Q R and R = U' S V^T give X V = U S, the scaled directions, at a fraction of the time.
    const Eigen::Index m = x.cols();
    const Eigen::HouseholderQR<Eigen::MatrixXd> qr(x);
    const Eigen::MatrixXd r = qr.matrixQR().topRows(m).triangularView<Eigen::Upper>();
    q_ = x * Eigen::JacobiSVD<Eigen::MatrixXd>(r, Eigen::ComputeFullV).matrixV();
  }

  /// The whole channel from rho at some cells (positions in cells_above_horizon()).
  Eigen::VectorXd reconstruct(const std::vector<Eigen::Index>& at,
                              const Eigen::VectorXd& rho) const {
    const Eigen::Index n = static_cast<Eigen::Index>(at.size());
    const Eigen::MatrixXd a = q_(at, Eigen::seqN(0, n));
    const Eigen::VectorXd y =
        (((rho.cwiseProduct(weight_(at)).array() + kEps) / (reference_(at).array() + kEps)).log())
            .matrix() -
        mean_(at);
    const Eigen::MatrixXd normal = a.transpose() * a + 40.0 * Eigen::MatrixXd::Identity(n, n);
    const Eigen::VectorXd c = normal.fullPivLu().solve(a.transpose() * y);
    const Eigen::ArrayXd x = (q_.leftCols(n) * c + mean_).array();
    return ((x.exp() * (reference_.array() + kEps) - kEps) / weight_.array()).matrix();
  }

 private:
  static constexpr double kEps = 0.001;
  Eigen::MatrixXd q_;
  Eigen::VectorXd weight_, reference_, mean_;
};

TEST(PublishedMethod, GivesTheNumbersOfADenseComputationWithItsMedianReference) {
  constexpr int kUsed = 2;
  const Published published(kUsed);
  const std::vector<std::size_t> materials = {0, 1};
  const Basis basis = train(test::training_set(), test::training_gram(), materials);

  const std::vector<brdf::lattice::Index> indices = {
      {16, 12, 28}, {21, 77, 77}, {75, 19, 89}, {36, 4, 130}};
  const auto& cells = brdf::lattice::cells_above_horizon();
  std::vector<Eigen::Index> positions;
  std::vector<brdf::HalfDiff> directions;
  for (const brdf::lattice::Index& index : indices) {
    const auto cell = static_cast<std::uint32_t>(brdf::lattice::cell_from_index(index));
    positions.push_back(std::lower_bound(cells.begin(), cells.end(), cell) - cells.begin());
    directions.push_back(brdf::lattice::angles_of(index));
  }
  const samples::SampleSet set = test::sample(test::material(50), directions);
  ReconstructOptions options;
  options.method = Method::nielsen;
  const Fit found = fit(basis, set, options);
  EXPECT_TRUE(found.coefficients.bottomRows(basis.component_count() - 4).isZero(0.0))
      << "more components than samples";

  const brdf::BrdfTable table = expand(basis, found.coefficients);
  for (int channel = 0; channel < 3; ++channel) {
    Eigen::VectorXd rho(4);
    for (Eigen::Index i = 0; i < 4; ++i) {
      rho[i] = set.samples[static_cast<std::size_t>(i)].value_per_sr[channel];
    }
    const Eigen::VectorXd expected = published.reconstruct(positions, rho);
    for (std::size_t i = 0; i < cells.size(); i += 101) {
      const double wanted = std::max(expected[static_cast<Eigen::Index>(i)], 0.0);
      // float32 rows of the basis; 1e-6 is where the subtraction of epsilon ends
      ASSERT_NEAR(table.value(cells[i])[channel], wanted, 3e-4 * wanted + 3e-5)
          << "cell " << cells[i] << " channel " << channel;
    }
  }
}

}  // namespace
}  // namespace gonio::basis
