#pragma once

#include "gonio/brdf/directions.h"

namespace gonio::basis {

/// The mapping g(f) = ln(f w + eps), w = clip(cos theta_i cos theta_o, floor, 1), in which
/// materials are close to a linear space (Nielsen, Jensen, Ramamoorthi 2015; the reference row they
/// divide by cancels in the centring and is left out).
///
/// Units    f in 1/sr of the basis' radiometric scale; x in nepers.
struct LogMapping {
  double epsilon = 1e-3;
  double cosine_floor = 0.01;

  double weight(const brdf::PolarCosines& cosines) const;
  /// NaN when f w + eps <= 0 (a dark sample: solve with relinearisation instead).
  double forward(double f_per_sr, double weight) const;
  /// Clamped at 0 1/sr.
  double inverse(double x, double weight) const;
  /// d g / d f at f.
  double derivative(double f_per_sr, double weight) const;

  bool operator==(const LogMapping&) const = default;
};

}  // namespace gonio::basis
