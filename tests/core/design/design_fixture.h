#pragma once

#include <Eigen/Core>
#include <cmath>

#include "gonio/basis/basis.h"
#include "gonio/random/distributions.h"
#include "gonio/random/key.h"

namespace gonio::design {

inline constexpr double kRounding = 1e-9;    ///< double arithmetic on matrices of this size
inline constexpr double kMonteCarlo = 0.03;  ///< 20,000 draws: 1 % standard error, three of them

/// Rows of a made-up basis: normal numbers, columns falling like singular values do.
inline basis::RowMajorMatrixXf made_up_rows(Eigen::Index p, Eigen::Index k,
                                            std::uint64_t seed = 11) {
  const random::Key key = random::make_key(seed, "test.rows");
  basis::RowMajorMatrixXf rows(p, k);
  for (Eigen::Index i = 0; i < p; ++i) {
    for (Eigen::Index j = 0; j < k; ++j) {
      rows(i, j) = static_cast<float>(10.0 * std::pow(0.6, j) *
                                      random::normal(key, static_cast<std::uint64_t>(i * k + j)));
    }
  }
  return rows;
}

inline Eigen::MatrixXd rows_of(const basis::RowMajorMatrixXf& rows,
                               const std::vector<std::uint32_t>& cells) {
  Eigen::MatrixXd result(static_cast<Eigen::Index>(cells.size()), rows.cols());
  for (std::size_t i = 0; i < cells.size(); ++i) {
    result.row(static_cast<Eigen::Index>(i)) = rows.row(cells[i]).cast<double>();
  }
  return result;
}

}  // namespace gonio::design
