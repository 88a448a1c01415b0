#pragma once

#include <bit>
#include <cstdint>

/// Exponential and logarithm as plain arithmetic, which compilers turn into vectors: the same bits
/// one by one and by the lane. Both within 1 ulp where they are used.
namespace gonio::random::detail {

inline constexpr double kLn2High =
    0x1.62e42fefa38p-1;  // ln 2 to 40 bits: whole multiples are exact
inline constexpr double kLn2Low = 0x1.ef35793c7673p-45;
inline constexpr double kLog2E = 0x1.71547652b82fep0;

/// exp(x) for x in [-700, 0].
inline double exp_of(double x) {
  constexpr double kWhole = 0x1.8p52;  // what is added to it is rounded to a whole number
  const double shifted = x * kLog2E + kWhole;
  const double n = shifted - kWhole;
  const double r = (x - n * kLn2High) - n * kLn2Low;  // |r| <= ln 2 / 2
  // Taylor's series: what is left out, r^14 / 14!, is below 4e-18.
  double sum = 1.0 / 6227020800.0;
  sum = sum * r + 1.0 / 479001600.0;
  sum = sum * r + 1.0 / 39916800.0;
  sum = sum * r + 1.0 / 3628800.0;
  sum = sum * r + 1.0 / 362880.0;
  sum = sum * r + 1.0 / 40320.0;
  sum = sum * r + 1.0 / 5040.0;
  sum = sum * r + 1.0 / 720.0;
  sum = sum * r + 1.0 / 120.0;
  sum = sum * r + 1.0 / 24.0;
  sum = sum * r + 1.0 / 6.0;
  sum = sum * r + 0.5;
  sum = sum * r + 1.0;
  sum = sum * r + 1.0;
  return std::bit_cast<double>(std::bit_cast<std::uint64_t>(sum) +
                               (std::bit_cast<std::uint64_t>(shifted) << 52U));
}

/// Natural logarithm of a positive, normal number.
inline double log_of(double x) {
  // x = 2^e m with m in [sqrt(1/2), sqrt(2)).
  constexpr std::uint64_t kSqrtHalf = 0x3FE6'A09E'667F'3BCD;
  constexpr std::uint64_t kBias = std::uint64_t{1023} << 52U;
  const std::uint64_t bits = std::bit_cast<std::uint64_t>(x);
  const std::uint64_t biased = (bits - kSqrtHalf + kBias) >> 52U;  // e + 1023
  const double m = std::bit_cast<double>(bits - (biased << 52U) + kBias);
  const double e =
      std::bit_cast<double>(biased | std::bit_cast<std::uint64_t>(0x1p52)) - (0x1p52 + 1023.0);
  // log(m) = 2 artanh(s), s = f / (2 + f), |s| < 0.172, as f - f^2/2 + s (f^2/2 + R), which loses
  // nothing near 1; what is left out of the series R is below 1e-18.
  const double f = m - 1.0;
  const double s = f / (2.0 + f);
  const double z = s * s;
  double series = 2.0 / 23.0;
  series = series * z + 2.0 / 21.0;
  series = series * z + 2.0 / 19.0;
  series = series * z + 2.0 / 17.0;
  series = series * z + 2.0 / 15.0;
  series = series * z + 2.0 / 13.0;
  series = series * z + 2.0 / 11.0;
  series = series * z + 2.0 / 9.0;
  series = series * z + 2.0 / 7.0;
  series = series * z + 2.0 / 5.0;
  series = series * z + 2.0 / 3.0;
  const double half_square = 0.5 * f * f;
  return e * kLn2High + (f - (half_square - (s * (half_square + series * z) + e * kLn2Low)));
}

}  // namespace gonio::random::detail
