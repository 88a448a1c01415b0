#include "gonio/instrument/response_curve.h"

#include <fmt/format.h>

#include <cmath>

#include "gonio/errors/errors.h"

namespace gonio::instrument {

double ResponseCurve::slope(double measured_dn) const {
  const double u = measured_dn / scale_dn;
  return 1.0 + u * (2.0 * c1 + 3.0 * u * c2);
}

double ResponseCurve::measured_dn(double linear_dn) const {
  // Newton converges in four rounds on a curve of a few per cent.
  constexpr int kMaxRounds = 50;
  constexpr double kRelative = 1e-13;
  double measured = linear_dn;
  for (int round = 0; round < kMaxRounds; ++round) {
    const double rise = slope(measured);
    if (!(rise > 0.0)) break;
    const double change = (this->linear_dn(measured) - linear_dn) / rise;
    measured -= change;
    if (std::abs(change) <= kRelative * std::abs(scale_dn)) {
      if (!(slope(measured) > 0.0)) break;
      return measured;
    }
  }
  throw NumericalError(fmt::format(
      "response curve (c1 {}, c2 {}): no measured signal gives {} DN, expected a rising curve", c1,
      c2, linear_dn));
}

}  // namespace gonio::instrument
