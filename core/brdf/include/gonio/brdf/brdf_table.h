#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "gonio/brdf/brdf_model.h"
#include "gonio/brdf/merl_lattice.h"

namespace gonio::brdf {

/// A measured or reconstructed isotropic BRDF on the MERL lattice.
///
/// Stored   Three planes (R, G, B) of lattice::kCells doubles as they stand in a MERL file;
///          value in 1/sr = stored * kMerlScale[channel]; negative = invalid. The stored numbers
///          are kept, so a file read and written unchanged is byte-identical.
/// State    A value type (35 MB): move it, do not copy it by accident.
/// Threads  const members may be called from many threads.
class BrdfTable {
 public:
  /// Scale of the MERL file's planes (Matusik et al. 2003, reference reader).
  static constexpr double kMerlScale[3] = {1.0 / 1500.0, 1.15 / 1500.0, 1.66 / 1500.0};

  /// All cells invalid.
  explicit BrdfTable(IndexConvention convention = IndexConvention::bin_centre,
                     RadiometricScale scale = RadiometricScale::si);
  /// Takes three planes of stored numbers. Throws std::invalid_argument unless 3 * kCells long.
  BrdfTable(std::vector<double> stored_planes, IndexConvention convention, RadiometricScale scale);

  IndexConvention convention() const { return convention_; }
  RadiometricScale scale() const { return scale_; }

  /// All three channels stored non-negative.
  bool valid(std::size_t cell) const;
  /// 1/sr; NaN in all channels when the cell is invalid.
  Rgb value(std::size_t cell) const;
  /// Stores 1/sr, such that value() returns it within 1 ulp; negatives are clamped at 0.
  /// Throws std::invalid_argument when a channel is NaN or infinite. Different cells may be set
  /// from different threads.
  void set_value(std::size_t cell, const Rgb& per_sr);
  /// Stores -1 in all channels.
  void set_invalid(std::size_t cell);

  const std::vector<double>& stored_planes() const { return stored_; }

  /// All valid values times `factor`, said to be in scale `to`. Throws std::invalid_argument unless
  /// `factor` is above 0 and finite.
  BrdfTable rescaled(double factor, RadiometricScale to) &&;

 private:
  std::vector<double> stored_;
  IndexConvention convention_;
  RadiometricScale scale_;
};

/// `nearest` is the reference C reader's behaviour; `trilinear` is the default and the simulator's
/// truth.
enum class Interpolation { nearest, trilinear };

/// Evaluates a table at any direction. Takes its own copy of the usable cells (valid in the table
/// and above the horizon), ordered for speed: 47 MB, and the table may go.
///
/// Within the last fraction of a degree before the horizon all corners of a direction may be
/// unusable (theta_i or theta_o > 89.5 deg for a complete table): the value there is 0.
class TableBrdf final : public BrdfModel {
 public:
  explicit TableBrdf(const BrdfTable& table, Interpolation how = Interpolation::trilinear);
  using BrdfModel::evaluate;
  Rgb evaluate(const DirectionPair& pair) const override;
  /// As above, from angles; phi_h does not matter.
  Rgb evaluate(const HalfDiff& angles) const;

 private:
  Rgb evaluate_visible(const ShadingGeometry& geometry) const override;
  Rgb at(double theta_h_rad, double theta_d_rad, double phi_d_rad) const;

  IndexConvention convention_;
  Interpolation how_;
  /// R, G, B in 1/sr and 1; all four 0 where unusable.
  std::vector<Eigen::Array4d, Eigen::aligned_allocator<Eigen::Array4d>> cells_;
};

/// A model evaluated at every cell above the horizon, in parallel. `scale` is what the model's
/// numbers are in; negatives become 0. Throws NumericalError, naming the angles, where the model is
/// not finite.
BrdfTable tabulate(const BrdfModel& model, RadiometricScale scale,
                   IndexConvention convention = IndexConvention::bin_centre);

/// A model evaluated in parallel at chosen cells only: all that training needs of it.
///
/// `cells`  Cell numbers, usually lattice::cells_above_horizon(convention).
/// Returns  Three planes (R, G, B) of cells.size() values in 1/sr, in the order of `cells`.
/// Throws   NumericalError where the model is not finite; std::invalid_argument for a cell that is
///          not on the lattice.
std::vector<double> values_at_cells(const BrdfModel& model, std::span<const std::uint32_t> cells,
                                    IndexConvention convention = IndexConvention::bin_centre);

/// The same from a table; NaN in all three planes where a cell is invalid.
std::vector<double> values_at_cells(const BrdfTable& table, std::span<const std::uint32_t> cells);

}  // namespace gonio::brdf
