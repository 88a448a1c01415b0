#include "gonio/design/importance.h"

#include <cblas.h>

#include <cmath>
#include <stdexcept>
#include <string>
#include <vector>

#include "gonio/brdf/cell_weight.h"
#include "gonio/brdf/merl_lattice.h"
#include "gonio/parallel/parallel.h"

namespace gonio::design {
namespace {

constexpr std::size_t kImportanceBlock = 8192;

}  // namespace

Eigen::VectorXf importance_weights(const ImportanceOptions& options) {
  if (!(options.uniform_blend >= 0.0 && options.uniform_blend <= 1.0)) {
    throw std::invalid_argument("importance: uniform_blend is " +
                                std::to_string(options.uniform_blend) + ", expected 0 to 1");
  }
  const std::vector<std::uint32_t>& cells = brdf::lattice::cells_above_horizon();
  Eigen::VectorXd solid_angle(static_cast<Eigen::Index>(cells.size()));
  for (std::size_t i = 0; i < cells.size(); ++i) {
    const brdf::HalfDiff at = brdf::lattice::angles_of(brdf::lattice::index_from_cell(cells[i]));
    solid_angle[static_cast<Eigen::Index>(i)] = brdf::cell_weight(at);
  }
  const double share = (1.0 - options.uniform_blend) / solid_angle.sum();
  const double floor = options.uniform_blend / static_cast<double>(cells.size());
  return (solid_angle.array() * share + floor).matrix().cast<float>();
}

Eigen::MatrixXd importance_matrix(const basis::RowMajorMatrixXf& rows,
                                  const Eigen::VectorXf& weights) {
  if (rows.rows() != weights.size()) {
    throw std::invalid_argument("importance: " + std::to_string(weights.size()) + " weights for " +
                                std::to_string(rows.rows()) + " rows");
  }
  const Eigen::Index k = rows.cols();
  const Eigen::ArrayXf root = weights.array().sqrt();
  return parallel::reduce_blocks(
      0, static_cast<std::size_t>(rows.rows()), kImportanceBlock,
      Eigen::MatrixXd(Eigen::MatrixXd::Zero(k, k)),
      [&](std::size_t from, std::size_t to) {
        const auto first = static_cast<Eigen::Index>(from);
        const auto count = static_cast<Eigen::Index>(to - from);
        const basis::RowMajorMatrixXf scaled =
            (rows.middleRows(first, count).array().colwise() * root.segment(first, count)).matrix();
        // Row-major upper = column-major lower: the symmetric part is filled below.
        basis::RowMajorMatrixXf product = basis::RowMajorMatrixXf::Zero(k, k);
        cblas_ssyrk(CblasRowMajor, CblasUpper, CblasTrans, static_cast<int>(k),
                    static_cast<int>(count), 1.0F, scaled.data(), static_cast<int>(k), 0.0F,
                    product.data(), static_cast<int>(k));
        return Eigen::MatrixXd(
            Eigen::MatrixXd(product.cast<double>()).selfadjointView<Eigen::Upper>());
      },
      [](Eigen::MatrixXd& total, Eigen::MatrixXd&& part) { total += part; });
}

}  // namespace gonio::design
