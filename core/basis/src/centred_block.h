#pragma once

#include <span>
#include <vector>

#include "gonio/basis/training_set.h"

namespace gonio::basis::detail {

/// Cells that are centred and multiplied at a time: with 270 rows 0.55 MB, which stays in the
/// second-level cache, and short enough to be summed in float32.
constexpr std::size_t kPackedCells = 512;
/// What a thread takes at a time.
constexpr std::size_t kBlockCells = 32 * kPackedCells;

/// Some rows of a training set and the copy of a range of their columns, mean subtracted.
///
/// Threads  One object per thread.
class CentredBlock {
 public:
  explicit CentredBlock(std::span<const float* const> rows)
      : rows_(rows), packed_(rows.size() * kPackedCells), mean_(kPackedCells) {}

  /// Takes columns [begin, end), at most kPackedCells.
  void load(std::size_t begin, std::size_t end);

  /// rows x width, row-major.
  const float* values() const { return packed_.data(); }
  std::size_t width() const { return width_; }
  std::span<const float> mean() const { return std::span<const float>(mean_).first(width_); }

 private:
  std::span<const float* const> rows_;
  std::vector<float> packed_;
  std::vector<float> mean_;
  std::size_t width_ = 0;
};

/// Start of the rows of some materials, R, G, B of each.
std::vector<const float*> row_pointers(const TrainingSet& set,
                                       std::span<const std::size_t> materials);

}  // namespace gonio::basis::detail
