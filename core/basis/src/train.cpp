#include <cblas.h>

#include <algorithm>
#include <numeric>
#include <stdexcept>
#include <string>
#include <utility>

#include "centred_block.h"
#include "gonio/basis/basis.h"
#include "gonio/errors/errors.h"
#include "gonio/parallel/parallel.h"
#include "spectrum.h"

namespace gonio::basis {
namespace {

void check_materials(const TrainingSet& set, const Eigen::MatrixXd& gram,
                     std::span<const std::size_t> materials, int component_count) {
  const Eigen::Index rows = 3 * static_cast<Eigen::Index>(set.material_count());
  if (gram.rows() != rows || gram.cols() != rows) {
    throw std::invalid_argument("train: Gram matrix of " + std::to_string(gram.rows()) +
                                " rows, the set has " + std::to_string(rows));
  }
  for (std::size_t i = 0; i < materials.size(); ++i) {
    if (materials[i] >= set.material_count() || (i > 0 && materials[i] <= materials[i - 1])) {
      throw std::invalid_argument("train: material indices must ascend and lie below " +
                                  std::to_string(set.material_count()));
    }
  }
  if (component_count < 1) throw std::invalid_argument("train: fewer than 1 component asked for");
  if (materials.size() < 2) {
    throw NumericalError("training needs at least 2 materials, found " +
                         std::to_string(materials.size()));
  }
}

/// The Gram of a subset's rows around their own mean. Centring twice is exact whatever mean had
/// been subtracted before.
Eigen::MatrixXd subset_gram(const Eigen::MatrixXd& gram, std::span<const std::size_t> materials) {
  const Eigen::Index m = 3 * static_cast<Eigen::Index>(materials.size());
  Eigen::MatrixXd part(m, m);
  for (std::size_t a = 0; a < materials.size(); ++a) {
    for (std::size_t b = 0; b < materials.size(); ++b) {
      part.block<3, 3>(static_cast<Eigen::Index>(3 * a), static_cast<Eigen::Index>(3 * b)) =
          gram.block<3, 3>(static_cast<Eigen::Index>(3 * materials[a]),
                           static_cast<Eigen::Index>(3 * materials[b]));
    }
  }
  const Eigen::VectorXd row_means = part.rowwise().mean();
  const double mean = row_means.mean();
  part.colwise() -= row_means;
  part.rowwise() -= row_means.transpose();
  part.array() += mean;
  return part;
}

}  // namespace

Basis train(const TrainingSet& set, const Eigen::MatrixXd& gram,
            std::span<const std::size_t> materials, int component_count) {
  check_materials(set, gram, materials, component_count);
  const Eigen::MatrixXd centred = subset_gram(gram, materials);
  detail::Spectrum spectrum = detail::spectrum_of(centred, component_count);
  const Eigen::Index m = centred.rows();
  const Eigen::Index k = spectrum.left_vectors.cols();
  // Row-major, as the product below wants it.
  const RowMajorMatrixXf directions = spectrum.left_vectors.cast<float>();

  Basis basis;
  basis.singular_values = std::move(spectrum.singular_values);
  basis.left_vectors = std::move(spectrum.left_vectors);
  basis.mapping = set.mapping();
  basis.scale = set.scale();
  for (const std::size_t material : materials) {
    basis.materials.push_back(set.materials()[material]);
  }
  const std::size_t p = set.cells().size();
  basis.mean.resize(static_cast<Eigen::Index>(p));
  basis.components.resize(static_cast<Eigen::Index>(p), k);

  const std::vector<const float*> rows = detail::row_pointers(set, materials);
  parallel::for_each_block(0, p, detail::kBlockCells, [&](std::size_t begin, std::size_t end) {
    detail::CentredBlock block(rows);
    for (std::size_t at = begin; at < end; at += detail::kPackedCells) {
      block.load(at, std::min(at + detail::kPackedCells, end));
      const int width = static_cast<int>(block.width());
      std::copy(block.mean().begin(), block.mean().end(), basis.mean.data() + at);
      cblas_sgemm(CblasRowMajor, CblasTrans, CblasNoTrans, width, static_cast<int>(k),
                  static_cast<int>(m), 1.0f, block.values(), width, directions.data(),
                  static_cast<int>(k), 0.0f,
                  basis.components.data() + at * static_cast<std::size_t>(k), static_cast<int>(k));
    }
  });
  return basis;
}

Basis train(const TrainingSet& set, const Eigen::MatrixXd& gram, int component_count) {
  std::vector<std::size_t> all(set.material_count());
  std::iota(all.begin(), all.end(), std::size_t{0});
  return train(set, gram, all, component_count);
}

}  // namespace gonio::basis
