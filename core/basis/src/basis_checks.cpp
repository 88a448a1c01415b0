#include "basis_checks.h"

#include <fmt/format.h>

#include <cmath>

#include "gonio/parallel/parallel.h"

namespace gonio::basis::detail {
namespace {

/// ln of the largest float32 is 88.7, of the smallest mapping epsilon that is read -69.
constexpr float kLargestLogarithm = 100.0f;

/// Float32 products leave 1e-8 of the first eigenvalue (kRankTolerance of training), other
/// programs' more; a column that was exchanged, scaled or emptied is off by its own size.
constexpr double kOwnTolerance = 0.01;
constexpr double kFirstTolerance = 1e-6;

struct Products {
  Eigen::VectorXd squares;     ///< of every column
  Eigen::VectorXd neighbours;  ///< column j times column j + 1
};

Products products_of(const RowMajorMatrixXf& components) {
  const Eigen::Index k = components.cols();
  constexpr std::size_t kRows = 1024;
  return parallel::reduce_blocks(
      0, static_cast<std::size_t>(components.rows()), kRows,
      Products{Eigen::VectorXd::Zero(k), Eigen::VectorXd::Zero(k - 1)},
      [&](std::size_t begin, std::size_t end) {
        Eigen::RowVectorXf squares = Eigen::RowVectorXf::Zero(k);
        Eigen::RowVectorXf neighbours = Eigen::RowVectorXf::Zero(k - 1);
        for (std::size_t i = begin; i < end; ++i) {
          const auto row = components.row(static_cast<Eigen::Index>(i));
          squares += row.cwiseAbs2();
          neighbours += row.head(k - 1).cwiseProduct(row.tail(k - 1));
        }
        return Products{squares.transpose().cast<double>(), neighbours.transpose().cast<double>()};
      },
      [](Products& total, Products&& part) {
        total.squares += part.squares;
        total.neighbours += part.neighbours;
      });
}

std::optional<Contradiction> in_singular_values(const Eigen::VectorXd& values, Eigen::Index k) {
  for (Eigen::Index j = 0; j < values.size(); ++j) {
    if (values[j] < 0.0) {
      return Contradiction{"singular_values",
                           fmt::format("found {:g} at {}, expected at least 0", values[j], j)};
    }
    // Behind the components stand those that were left out, possibly of an earlier training.
    if (j > 0 && j != k && values[j] > values[j - 1]) {
      return Contradiction{"singular_values",
                           fmt::format("found {:g} at {} after {:g}, expected descending values",
                                       values[j], j, values[j - 1])};
    }
  }
  return std::nullopt;
}

std::optional<Contradiction> in_components(const Basis& basis) {
  const Products products = products_of(basis.components);
  const Eigen::VectorXd& s = basis.singular_values;
  const double room = kFirstTolerance * s[0] * s[0];
  for (Eigen::Index j = 0; j < basis.components.cols(); ++j) {
    const double expected = s[j] * s[j];
    if (!(std::abs(products.squares[j] - expected) <= kOwnTolerance * expected + room)) {
      return Contradiction{"components",
                           fmt::format("found column {} of length {:g}, expected its singular "
                                       "value {:g}",
                                       j, std::sqrt(products.squares[j]), s[j])};
    }
  }
  for (Eigen::Index j = 0; j + 1 < basis.components.cols(); ++j) {
    const double product = products.neighbours[j];
    if (!(std::abs(product) <= kOwnTolerance * s[j] * s[j + 1] + room)) {
      return Contradiction{"components",
                           fmt::format("found columns {} and {} with product {:g}, expected "
                                       "columns at right angles",
                                       j, j + 1, product)};
    }
  }
  return std::nullopt;
}

}  // namespace

std::optional<Contradiction> contradiction_in(const Basis& basis) {
  Eigen::Index at = 0;
  if (const float largest = basis.mean.cwiseAbs().maxCoeff(&at); largest > kLargestLogarithm) {
    return Contradiction{"mean", fmt::format("found {:g} at {}, expected a logarithm within "
                                             "{:g} of 0",
                                             basis.mean[at], at, kLargestLogarithm)};
  }
  if (auto found = in_singular_values(basis.singular_values, basis.components.cols())) return found;
  return in_components(basis);
}

}  // namespace gonio::basis::detail
