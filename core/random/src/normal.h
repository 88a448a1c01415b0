#pragma once

#include <array>
#include <cmath>
#include <cstddef>

#include "elementary.h"

/// AS 241's rational approximations, apart from each other so that a batch can run the first on
/// everything without a branch and mend the tails.
namespace gonio::random::detail {

/// Numerator and denominator of degree 7, lowest power first.
struct Rational {
  std::array<double, 8> above;
  std::array<double, 8> below;

  double operator()(double x) const {
    double numerator = above[7];
    double denominator = below[7];
    for (std::size_t power = 7; power-- > 0;) {
      numerator = numerator * x + above[power];
      denominator = denominator * x + below[power];
    }
    return numerator / denominator;
  }
};

// Wichura (1988), PPND16.
inline constexpr Rational kCentre = {
    {3.3871328727963666080e0, 1.3314166789178437745e2, 1.9715909503065514427e3,
     1.3731693765509461125e4, 4.5921953931549871457e4, 6.7265770927008700853e4,
     3.3430575583588128105e4, 2.5090809287301226727e3},
    {1.0, 4.2313330701600911252e1, 6.8718700749205790830e2, 5.3941960214247511077e3,
     2.1213794301586595867e4, 3.9307895800092710610e4, 2.8729085735721942674e4,
     5.2264952788528545610e3}};
inline constexpr Rational kNearTail = {
    {1.42343711074968357734e0, 4.63033784615654529590e0, 5.76949722146069140550e0,
     3.64784832476320460504e0, 1.27045825245236838258e0, 2.41780725177450611770e-1,
     2.27238449892691845833e-2, 7.74545014278341407640e-4},
    {1.0, 2.05319162663775882187e0, 1.67638483018380384940e0, 6.89767334985100004550e-1,
     1.48103976427480074590e-1, 1.51986665636164571966e-2, 5.47593808499534494600e-4,
     1.05075007164441684324e-9}};
inline constexpr Rational kFarTail = {
    {6.65790464350110377720e0, 5.46378491116411436990e0, 1.78482653991729133580e0,
     2.96560571828504891230e-1, 2.65321895265761230930e-2, 1.24266094738807843860e-3,
     2.71155556874348757815e-5, 2.01033439929228813265e-7},
    {1.0, 5.99832206555887937690e-1, 1.36929880922735805310e-1, 1.48753612908506148525e-2,
     7.86869131145613259100e-4, 1.84631831751005468180e-5, 1.42151175831644588870e-7,
     2.04426310338993978564e-15}};

inline constexpr double kCentreHalfWidth = 0.425;

/// `q`  Probability less 1/2, |q| <= kCentreHalfWidth.
inline double quantile_in_centre(double q) {
  return q * kCentre(kCentreHalfWidth * kCentreHalfWidth - q * q);
}

inline constexpr double kNearTailEnd = 5.0;  // of r, as kNearTailShift
inline constexpr double kNearTailShift = 1.6;

/// `q`  Probability less 1/2, |q| > kCentreHalfWidth.
/// `outside`  The smaller of the probabilities below and above; given apart, since 1/2 - |q| has
///            lost the digits that a tiny probability had.
inline double quantile_in_tail(double q, double outside) {
  const double r = std::sqrt(-log_of(outside));
  const double magnitude =
      r <= kNearTailEnd ? kNearTail(r - kNearTailShift) : kFarTail(r - kNearTailEnd);
  return q < 0.0 ? -magnitude : magnitude;
}

/// The quantile for detail::centred(), whose 1/2 - |q| is exact.
inline double quantile_of_centred(double q) {
  const double magnitude = std::abs(q);
  return magnitude <= kCentreHalfWidth ? quantile_in_centre(q)
                                       : quantile_in_tail(q, 0.5 - magnitude);
}

}  // namespace gonio::random::detail
