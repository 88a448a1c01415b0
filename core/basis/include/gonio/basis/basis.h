#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "gonio/basis/training_set.h"
#include "gonio/brdf/merl_lattice.h"

namespace gonio::basis {

/// As good as more for ten points; patches gain little (docs/results.md, "How many components").
constexpr int kDefaultComponents = 80;

using RowMajorMatrixXf = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// Principal components of mapped materials: x = mean + Q c with prior c ~ N(0, I/m).
///
/// Shape    `mean` p, `components` (Q = V S) p x k row-major, p = cells above the horizon in the
///          order of lattice::cells_above_horizon(), k <= m - 1; m = 3 * materials rows.
/// Source   Nielsen et al. 2015, section 4; the prior reading of ridge: docs/conventions.md.
struct Basis {
  LogMapping mapping;
  brdf::RadiometricScale scale = brdf::RadiometricScale::si;
  std::vector<MaterialId> materials;
  Eigen::VectorXf mean;
  RowMajorMatrixXf components;
  Eigen::VectorXd singular_values;  ///< all m - 1 of them, descending; the first k belong to Q
  /// U, m x k: training row t (R, G, B of each material in turn) is mean + Q u_t, up to the
  /// components that were cut off. Orthonormal columns with sums of 0.
  Eigen::MatrixXd left_vectors;

  int component_count() const { return static_cast<int>(components.cols()); }
  int row_count() const { return 3 * static_cast<int>(materials.size()); }  ///< m
};

/// Trains on some of a set's materials (indices into set.materials(), ascending) from the Gram of
/// the whole set. `component_count` is cut to the rank. Of each component's two possible signs the
/// one is taken that makes its largest entry over the training rows positive.
/// Throws NumericalError below 2 materials or when the spectrum is not finite or all materials are
/// the same; std::invalid_argument for indices out of range or order, another set's Gram, or a
/// component count below 1.
Basis train(const TrainingSet& set, const Eigen::MatrixXd& gram,
            std::span<const std::size_t> materials, int component_count = kDefaultComponents);

/// The same on all materials of the set.
Basis train(const TrainingSet& set, const Eigen::MatrixXd& gram,
            int component_count = kDefaultComponents);

/// Adds a set's materials to a basis without the files it was trained on.
///
/// Exact up to what the basis had left out: with all m - 1 components it equals training on all
/// materials at once; otherwise an old material enters as its truncation mean + Q u. Components no
/// stronger than the strongest that was left out are not known and are not kept, and the singular
/// values of what was left out stand on behind the kept ones. A cell that a new material misses
/// takes the old mean, not the new materials'.
///
/// Cost     p (k + 3 n)^2 multiply-adds for n new materials; no copy of either.
/// Throws   std::invalid_argument for another scale or mapping, a name the basis already has, no
///          material, a component count below 1; NumericalError as train().
/// Source   M. Brand, "Fast low-rank modifications of the thin singular value decomposition",
///          Linear Algebra and its Applications 415, 2006: appended rows and the changed mean; by
///          the Gram matrix of [Q, new rows] instead of a QR decomposition.
Basis append(const Basis& basis, const TrainingSet& added, int component_count);

/// Rows of Q and mu at a measured direction: interpolated trilinearly, never snapped to a cell.
struct BasisRow {
  Eigen::VectorXd q;  ///< k
  double mean = 0.0;
  double weight = 0.0;  ///< mapping weight at the exact direction
};

/// Looks rows up. Holds a reference: the basis must outlive it. Cheap to make.
///
/// Threads  at() from many.
class BasisRows {
 public:
  explicit BasisRows(const Basis& basis);
  /// Throws std::invalid_argument when the direction is below the horizon or an angle is out of
  /// range. Where all corners lie below the horizon (within the last degree before grazing) the
  /// nearest cell above it stands in.
  BasisRow at(const brdf::HalfDiff& direction) const;

  const Basis& basis() const { return basis_; }

 private:
  const Basis& basis_;
  const std::vector<std::int32_t>& column_of_cell_;  ///< -1 where the cell is not in the basis
};

}  // namespace gonio::basis
