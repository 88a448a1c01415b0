#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <stdexcept>

#include "bits.h"
#include "elementary.h"
#include "normal.h"

namespace gonio::random::detail {

inline constexpr double kInversionEnd = 10.0;
inline constexpr double kRejectionEnd = 1e6;

/// 1/k: the inversion divides by k in its inner loop.
inline constexpr auto kReciprocals = [] {
  std::array<double, 64> table{};
  for (std::size_t k = 1; k < table.size(); ++k) table[k] = 1.0 / static_cast<double>(k);
  return table;
}();

/// Counts up until the distribution function has passed `u`. Below a mean of 10 the last k of the
/// table has a probability under 1e-27, far below the steps of `u`.
inline double poisson_by_inversion(double u, double mean) {
  if (u < 1.0 - mean) return 0.0;  // below exp(-mean), which need not be known: dark pixels
  double probability = exp_of(-mean);
  std::size_t k = 0;
  while (u >= probability && k + 1 < kReciprocals.size()) {
    u -= probability;
    ++k;
    probability *= mean * kReciprocals[k];
  }
  return static_cast<double>(k);
}

inline constexpr std::size_t kLogFactorials = 16;

/// log(k!) for whole k >= 0: exact sums below kLogFactorials, Stirling's series above (error <
/// 1e-15 relative). std::lgamma is slower, and glibc's writes the global signgam from every thread.
inline double small_log_factorial(std::size_t k) {
  static const auto table = [] {
    std::array<double, kLogFactorials> logs{};
    for (std::size_t i = 2; i < logs.size(); ++i) {
      logs[i] = logs[i - 1] + std::log(static_cast<double>(i));
    }
    return logs;
  }();
  return table[k];
}
inline double large_log_factorial(double k) {
  constexpr double kHalfLogTwoPi = 0.91893853320467274178;
  const double inverse = 1.0 / k;
  const double square = inverse * inverse;
  const double series =
      inverse * (1.0 / 12.0 - square * (1.0 / 360.0 - square * (1.0 / 1260.0 - square / 1680.0)));
  return (k + 0.5) * log_of(k) - k + kHalfLogTwoPi + series;
}
inline double log_factorial(double k) {
  return k < static_cast<double>(kLogFactorials) ? small_log_factorial(static_cast<std::size_t>(k))
                                                 : large_log_factorial(k);
}

/// One attempt of algorithm PTRS of Hörmann (1993), with its constants.
struct Attempt {
  Attempt(double mean, Pair bits)
      : b(0.931 + 2.53 * std::sqrt(mean)),
        a(-0.059 + 0.02483 * b),
        u(centred(bits.first)),
        v(half_open(bits.second)),
        us(0.5 - std::abs(u)),
        k(std::floor((2.0 * a / us + b) * u + mean + 0.43)) {}

  /// Four of five attempts end here.
  bool quickly_accepted() const { return (us >= 0.07) & (v <= 0.9277 - 3.6224 / (b - 2.0)); }
  /// Neither this nor what is quickly accepted need be compared.
  bool refused() const { return (k < 0.0) | ((us < 0.013) & (v > us)); }

  /// What the logarithm of the distribution, less the mean's part log_factorial(k), is compared
  /// with: the attempt is accepted unless it is larger.
  double hurdle(double mean) const {
    constexpr double kLeast = 0x1p-60;  // for v = 0, which has no logarithm
    const double inverse_alpha = 1.1239 + 1.1328 / (b - 3.4);
    return log_of((v > kLeast ? v : kLeast) * inverse_alpha / (a / (us * us) + b)) -
           (k * log_of(mean) - mean);
  }

  bool accepted(double mean) const {
    if (quickly_accepted()) return true;
    return !refused() && hurdle(mean) <= -log_factorial(k);
  }

  double b, a, u, v, us;
  double k;  ///< what is drawn if the attempt is accepted
};

/// About 1.1 attempts. `bits` are those of the first.
inline double poisson_by_rejection(Key key, std::uint64_t counter, double mean, Pair bits) {
  for (std::uint32_t attempt = 0;;) {
    const Attempt drawn(mean, bits);
    if (drawn.accepted(mean)) return drawn.k;
    bits = random_pair(key, Purpose::Poisson, counter, ++attempt);
  }
}

/// `bits` = random_pair(key, Purpose::Poisson, counter).
inline double poisson_value(Key key, std::uint64_t counter, double mean, Pair bits) {
  if (!(mean >= 0.0) || std::isinf(mean)) {
    throw std::invalid_argument("poisson: the mean must be finite and not negative");
  }
  if (mean < kInversionEnd) return poisson_by_inversion(half_open(bits.first), mean);
  if (mean <= kRejectionEnd) return poisson_by_rejection(key, counter, mean, bits);
  return std::nearbyint(mean + std::sqrt(mean) * quantile_of_centred(centred(bits.first)));
}

}  // namespace gonio::random::detail
