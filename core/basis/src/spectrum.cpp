#include "spectrum.h"

#include <Eigen/Eigenvalues>
#include <algorithm>

#include "gonio/errors/errors.h"

namespace gonio::basis::detail {
namespace {

/// Eigenvalues below this share of the first are rounding of the float32 products.
constexpr double kRankTolerance = 1e-8;

}  // namespace

Spectrum spectrum_of(const Eigen::MatrixXd& gram, int component_count, double least) {
  if (!gram.allFinite()) throw NumericalError("training: the Gram matrix is not finite");
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(gram);
  if (solver.info() != Eigen::Success) {
    throw NumericalError("training: the eigenvalues of the Gram matrix did not converge");
  }
  const Eigen::Index m = gram.rows();
  const Eigen::VectorXd eigenvalues = solver.eigenvalues().reverse();
  const auto above = [&](double limit) {
    return (eigenvalues.head(m - 1).array() > limit).count();
  };
  const Eigen::Index rank = above(std::max(kRankTolerance * eigenvalues[0], 0.0));
  if (rank == 0) throw NumericalError("training: all materials are the same");
  const Eigen::Index known = std::max<Eigen::Index>(above(least * least), 1);
  const Eigen::Index k = std::min({Eigen::Index{component_count}, rank, known});

  Spectrum spectrum;
  spectrum.singular_values = eigenvalues.head(m - 1).cwiseMax(0.0).cwiseSqrt();
  spectrum.left_vectors = solver.eigenvectors().rightCols(k).rowwise().reverse();
  // Exactly centred: rounding of the strongest component leaves a mean in the weakest.
  spectrum.left_vectors.rowwise() -= spectrum.left_vectors.colwise().mean().eval();
  for (Eigen::Index j = 0; j < k; ++j) {
    auto column = spectrum.left_vectors.col(j);
    Eigen::Index largest = 0;
    column.cwiseAbs().maxCoeff(&largest);
    if (column[largest] < 0.0) column *= -1.0;
  }
  return spectrum;
}

}  // namespace gonio::basis::detail
