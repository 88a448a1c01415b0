#pragma once

namespace gonio::instrument {

/// How a nearly linear sensor bends: linear = y (1 + c1 u + c2 u^2), u = y / scale, with y the
/// signal above black as measured. The slope is 1 at black, so that a gain found there holds.
struct ResponseCurve {
  double scale_dn = 1.0;  ///< above black; where u = 1, the saturation
  double c1 = 0.0;
  double c2 = 0.0;

  /// Signal above black that a straight sensor would have given.
  double linear_dn(double measured_dn) const {
    const double u = measured_dn / scale_dn;
    return measured_dn * (1.0 + u * (c1 + u * c2));
  }
  /// d linear / d measured: noise of a measured signal times this is noise of the linear one.
  double slope(double measured_dn) const;
  /// The inverse of linear_dn. Throws NumericalError where the curve does not rise.
  double measured_dn(double linear_dn) const;
};

}  // namespace gonio::instrument
