#include <cblas.h>

#include <algorithm>
#include <cstdint>
#include <functional>
#include <numeric>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "centred_block.h"
#include "gonio/basis/basis.h"
#include "gonio/parallel/parallel.h"
#include "spectrum.h"

namespace gonio::basis {
namespace {

using detail::kBlockCells;
using detail::kPackedCells;

void check(const Basis& basis, const TrainingSet& added, int component_count) {
  const auto refuse = [](const std::string& why) { throw std::invalid_argument("append: " + why); };
  if (component_count < 1) refuse("fewer than 1 component asked for");
  if (added.material_count() == 0) refuse("no material to add");
  if (added.scale() != basis.scale) {
    refuse("materials of radiometric scale " + std::string(to_string(added.scale())) +
           ", the basis has " + std::string(to_string(basis.scale)));
  }
  if (!(added.mapping() == basis.mapping)) refuse("materials of another mapping");
  for (const MaterialId& id : added.materials()) {
    for (const MaterialId& known : basis.materials) {
      if (id.name == known.name) refuse("material " + id.name + " is already in the basis");
    }
  }
}

/// Some cells of the matrix all rows are combinations of: the old components, then every new row
/// less the old mean. width x (k + 3 n), row-major.
class JoinedBlock {
 public:
  JoinedBlock(const Basis& basis, const TrainingSet& added) : basis_(basis), added_(added) {
    std::vector<std::size_t> all(added.material_count());
    std::iota(all.begin(), all.end(), std::size_t{0});
    rows_ = detail::row_pointers(added, all);
    values_.resize(kPackedCells * columns());
  }

  std::size_t columns() const {
    return static_cast<std::size_t>(basis_.components.cols()) + rows_.size();
  }
  const float* values() const { return values_.data(); }

  /// Takes cells [begin, end), at most kPackedCells.
  void load(std::size_t begin, std::size_t end) {
    const std::size_t k = static_cast<std::size_t>(basis_.components.cols());
    const float* const q = basis_.components.data();
    for (std::size_t i = begin; i < end; ++i) {
      std::copy_n(q + i * k, k, values_.data() + (i - begin) * columns());
    }
    for (std::size_t row = 0; row < rows_.size(); ++row) {
      float* const column = values_.data() + k + row;
      for (std::size_t i = begin; i < end; ++i) {
        column[(i - begin) * columns()] = rows_[row][i] - basis_.mean[static_cast<Eigen::Index>(i)];
      }
      const auto missing = added_.missing(row / 3);
      for (auto at = std::lower_bound(missing.begin(), missing.end(), begin);
           at != missing.end() && *at < end; ++at) {
        column[(*at - begin) * columns()] = 0.0f;
      }
    }
  }

 private:
  const Basis& basis_;
  const TrainingSet& added_;
  std::vector<const float*> rows_;
  std::vector<float> values_;
};

/// Calls body(block, begin, end) for all cells of a range, kPackedCells at a time.
template <typename Body>
void for_each_packed(JoinedBlock& block, std::size_t begin, std::size_t end, Body&& body) {
  for (std::size_t at = begin; at < end; at += kPackedCells) {
    const std::size_t stop = std::min(at + kPackedCells, end);
    block.load(at, stop);
    body(at, stop);
  }
}

/// Products of all columns with each other, summed over the cells.
Eigen::MatrixXd joined_gram(const Basis& basis, const TrainingSet& added) {
  const Eigen::Index n = static_cast<Eigen::Index>(JoinedBlock(basis, added).columns());
  Eigen::MatrixXd gram = parallel::reduce_blocks(
      0, added.cells().size(), kBlockCells, Eigen::MatrixXd(Eigen::MatrixXd::Zero(n, n)),
      [&](std::size_t begin, std::size_t end) {
        Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(n, n);
        RowMajorMatrixXf product = RowMajorMatrixXf::Zero(n, n);
        JoinedBlock block(basis, added);
        for_each_packed(block, begin, end, [&](std::size_t from, std::size_t to) {
          cblas_ssyrk(CblasRowMajor, CblasLower, CblasTrans, static_cast<int>(n),
                      static_cast<int>(to - from), 1.0f, block.values(), static_cast<int>(n), 0.0f,
                      product.data(), static_cast<int>(n));
          sum += product.cast<double>();
        });
        return sum;
      },
      [](Eigen::MatrixXd& total, Eigen::MatrixXd&& part) { total += part; });
  gram.triangularView<Eigen::StrictlyUpper>() = gram.transpose();
  return gram;
}

}  // namespace

Basis append(const Basis& basis, const TrainingSet& added, int component_count) {
  check(basis, added, component_count);
  const Eigen::Index old_rows = basis.row_count();
  const Eigen::Index new_rows = 3 * static_cast<Eigen::Index>(added.material_count());
  const Eigen::Index old_k = basis.components.cols();
  const Eigen::Index n = old_k + new_rows;

  // All rows less the old mean are `combinations` of the joined columns; less their own mean, they
  // are the same with the mean combination taken off.
  Eigen::MatrixXd combinations = Eigen::MatrixXd::Zero(old_rows + new_rows, n);
  combinations.topLeftCorner(old_rows, old_k) = basis.left_vectors;
  combinations.bottomRightCorner(new_rows, new_rows).setIdentity();
  const Eigen::VectorXf mean_shift = combinations.colwise().mean().transpose().cast<float>();
  combinations.rowwise() -= combinations.colwise().mean().eval();

  const Eigen::Index left_out = basis.singular_values.size() - old_k;
  detail::Spectrum spectrum =
      detail::spectrum_of(combinations * joined_gram(basis, added) * combinations.transpose(),
                          component_count, left_out > 0 ? basis.singular_values[old_k] : 0.0);
  const Eigen::Index k = spectrum.left_vectors.cols();
  const RowMajorMatrixXf directions =
      (combinations.transpose() * spectrum.left_vectors).cast<float>();

  Basis joined;
  joined.mapping = basis.mapping;
  joined.scale = basis.scale;
  joined.materials = basis.materials;
  joined.materials.insert(joined.materials.end(), added.materials().begin(),
                          added.materials().end());
  // At most n of them are not 0: what had been left out takes the places behind.
  joined.singular_values = std::move(spectrum.singular_values);
  joined.singular_values.tail(left_out) = basis.singular_values.tail(left_out);
  std::sort(joined.singular_values.data() + k,
            joined.singular_values.data() + joined.singular_values.size(), std::greater<>());
  joined.left_vectors = std::move(spectrum.left_vectors);
  joined.mean = basis.mean;
  joined.components.resize(basis.components.rows(), k);
  parallel::for_each_block(
      0, added.cells().size(), kBlockCells, [&](std::size_t begin, std::size_t end) {
        JoinedBlock block(basis, added);
        for_each_packed(block, begin, end, [&](std::size_t from, std::size_t to) {
          const int width = static_cast<int>(to - from);
          cblas_sgemv(CblasRowMajor, CblasNoTrans, width, static_cast<int>(n), 1.0f, block.values(),
                      static_cast<int>(n), mean_shift.data(), 1, 1.0f, joined.mean.data() + from,
                      1);
          cblas_sgemm(CblasRowMajor, CblasNoTrans, CblasNoTrans, width, static_cast<int>(k),
                      static_cast<int>(n), 1.0f, block.values(), static_cast<int>(n),
                      directions.data(), static_cast<int>(k), 0.0f,
                      joined.components.data() + from * static_cast<std::size_t>(k),
                      static_cast<int>(k));
        });
      });
  return joined;
}

}  // namespace gonio::basis
