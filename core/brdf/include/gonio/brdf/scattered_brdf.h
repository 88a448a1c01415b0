#pragma once

#include <memory>
#include <span>
#include <vector>

#include "gonio/brdf/brdf_table.h"

namespace gonio::brdf {

/// A BRDF value at a pair of directions above the horizon.
struct ScatteredValue {
  DirectionPair pair;
  Rgb per_sr;
};

/// Which configurations count as the same when scattered values are interpolated.
enum class Symmetry {
  /// Light and detector may change places. Samples on one side of the plane of incidence then say
  /// all about the other: nothing is mirrored, and a material need not be bilateral.
  reciprocal,
  /// Not even that: for testing reciprocity. Samples all on one side are mirrored, because without
  /// the other side there is nothing to compare.
  one_way
};

/// Scattered measurements of an isotropic BRDF, interpolated.
///
/// Method   Local linear regression of ln(f + 0.001) over the twenty nearest samples with tricube
///          weights, in coordinates that are smooth at the poles: (2 sqrt theta_h, theta_d,
///          r cos m phi_d, r sin m phi_d), r = sqrt(theta_h) sin theta_d, m = 2 (1 for one_way),
///          radians. Kept between the lowest and the highest of the twenty. With every light angle
///          of three Cornell paints left out in turn (rings 10 deg apart) the median error is 2 to
///          4 %, the rms of the weighted logarithm 0.07 to 0.14; leaving out single samples it is
///          as good as Gaussian processes of several kernels, and needs no length scale.
/// Covered  Where a sample lies within 0.25 in those coordinates (about 14 deg) and neither
///          direction is more than 5 deg nearer to the horizon than any measured one.
/// Source   Cleveland and Devlin, "Locally Weighted Regression", J. Am. Stat. Assoc. 83, 1988.
/// Threads  const members from many.
class ScatteredBrdf final : public BrdfModel {
 public:
  /// Fewer say too little about a BRDF.
  static constexpr std::size_t kFewestSamples = 50;

  /// Throws std::invalid_argument for fewer than kFewestSamples, a direction at or below the
  /// horizon, or a value that is negative or not finite.
  explicit ScatteredBrdf(std::span<const ScatteredValue> samples,
                         Symmetry symmetry = Symmetry::reciprocal);
  ~ScatteredBrdf() override;
  ScatteredBrdf(ScatteredBrdf&&) noexcept;
  ScatteredBrdf& operator=(ScatteredBrdf&&) = delete;

  using BrdfModel::evaluate;
  /// Extrapolates where it is not covered.
  Rgb evaluate(const DirectionPair& pair) const override;
  bool covers(const DirectionPair& pair) const;

 private:
  struct Prepared;
  std::unique_ptr<const Prepared> prepared_;
};

/// On the lattice, in parallel; cells that are not covered stay without a value.
BrdfTable tabulate_covered(const ScatteredBrdf& brdf, RadiometricScale scale);

}  // namespace gonio::brdf
