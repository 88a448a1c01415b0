#include <cblas.h>

#include <algorithm>
#include <array>
#include <numeric>

#include "centred_block.h"
#include "gonio/basis/training_set.h"
#include "gonio/parallel/parallel.h"
#include "vector_math.h"

namespace gonio::basis {
namespace detail {

void CentredBlock::load(std::size_t begin, std::size_t end) {
  width_ = end - begin;
  std::array<double, kPackedCells> sums{};
  for (const float* const row : rows_) add_to_sums(row + begin, width_, sums.data());
  for (std::size_t j = 0; j < width_; ++j) {
    mean_[j] = static_cast<float>(sums[j] / static_cast<double>(rows_.size()));
  }
  float* out = packed_.data();
  for (const float* const row : rows_) {
    subtract(row + begin, mean_.data(), width_, out);
    out += width_;
  }
}

std::vector<const float*> row_pointers(const TrainingSet& set,
                                       std::span<const std::size_t> materials) {
  std::vector<const float*> rows;
  rows.reserve(3 * materials.size());
  for (const std::size_t material : materials) {
    for (int channel = 0; channel < 3; ++channel) {
      rows.push_back(set.row(material, channel).data());
    }
  }
  return rows;
}

}  // namespace detail

Eigen::MatrixXd centred_gram(const TrainingSet& set) {
  std::vector<std::size_t> all(set.material_count());
  std::iota(all.begin(), all.end(), std::size_t{0});
  const std::vector<const float*> rows = detail::row_pointers(set, all);
  const Eigen::Index m = static_cast<Eigen::Index>(rows.size());

  using RowMajorXf = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  const auto gram_of_cells = [&](std::size_t begin, std::size_t end) {
    Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(m, m);
    RowMajorXf product = RowMajorXf::Zero(m, m);
    detail::CentredBlock block(rows);
    for (std::size_t at = begin; at < end; at += detail::kPackedCells) {
      block.load(at, std::min(at + detail::kPackedCells, end));
      const int width = static_cast<int>(block.width());
      cblas_ssyrk(CblasRowMajor, CblasLower, CblasNoTrans, static_cast<int>(m), width, 1.0f,
                  block.values(), width, 0.0f, product.data(), static_cast<int>(m));
      // Row-major lower is column-major upper: the same memory order on both sides.
      for (Eigen::Index row = 0; row < m; ++row) {
        sum.col(row).head(row + 1) += product.row(row).head(row + 1).transpose().cast<double>();
      }
    }
    return sum;
  };
  Eigen::MatrixXd gram = parallel::reduce_blocks(
      0, set.cells().size(), detail::kBlockCells, Eigen::MatrixXd(Eigen::MatrixXd::Zero(m, m)),
      gram_of_cells, [](Eigen::MatrixXd& total, Eigen::MatrixXd&& part) { total += part; });
  gram.triangularView<Eigen::StrictlyLower>() = gram.transpose();
  return gram;
}

}  // namespace gonio::basis
