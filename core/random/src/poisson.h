#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <stdexcept>

#include "bits.h"
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
  double probability = std::exp(-mean);
  std::size_t k = 0;
  while (u >= probability && k + 1 < kReciprocals.size()) {
    u -= probability;
    ++k;
    probability *= mean * kReciprocals[k];
  }
  return static_cast<double>(k);
}

/// log(k!) for whole k: exact sums below the table's end, Stirling's series above (error < 1e-15
/// relative). std::lgamma is slower, and glibc's writes the global signgam from every thread.
inline double log_factorial(double k) {
  static const auto table = [] {
    std::array<double, 16> logs{};
    for (std::size_t i = 2; i < logs.size(); ++i) {
      logs[i] = logs[i - 1] + std::log(static_cast<double>(i));
    }
    return logs;
  }();
  if (k < static_cast<double>(table.size())) return table[static_cast<std::size_t>(k)];
  constexpr double kHalfLogTwoPi = 0.91893853320467274178;
  const double inverse = 1.0 / k;
  const double square = inverse * inverse;
  const double series =
      inverse * (1.0 / 12.0 - square * (1.0 / 360.0 - square * (1.0 / 1260.0 - square / 1680.0)));
  return (k + 0.5) * std::log(k) - k + kHalfLogTwoPi + series;
}

/// Algorithm PTRS of Hörmann (1993), with its constants. About 1.1 attempts, four of five of which
/// end at the quick acceptance.
inline double poisson_by_rejection(Key key, std::uint64_t counter, double mean) {
  const double b = 0.931 + 2.53 * std::sqrt(mean);
  const double a = -0.059 + 0.02483 * b;
  const double quick = 0.9277 - 3.6224 / (b - 2.0);
  for (std::uint32_t attempt = 0;; ++attempt) {
    const Pair bits = random_pair(key, Purpose::Poisson, counter, attempt);
    const double u = centred(bits.first);
    const double v = half_open(bits.second);
    const double us = 0.5 - std::abs(u);
    const double k = std::floor((2.0 * a / us + b) * u + mean + 0.43);
    if (us >= 0.07 && v <= quick) return k;
    if (k < 0.0 || (us < 0.013 && v > us)) continue;
    const double inverse_alpha = 1.1239 + 1.1328 / (b - 3.4);
    if (std::log(v * inverse_alpha / (a / (us * us) + b)) <=
        k * std::log(mean) - mean - log_factorial(k)) {
      return k;
    }
  }
}

inline double poisson_value(Key key, std::uint64_t counter, double mean) {
  if (!(mean >= 0.0) || std::isinf(mean)) {
    throw std::invalid_argument("poisson: the mean must be finite and not negative");
  }
  if (mean < kInversionEnd) {
    return poisson_by_inversion(half_open(random_pair(key, Purpose::Poisson, counter).first), mean);
  }
  if (mean <= kRejectionEnd) return poisson_by_rejection(key, counter, mean);
  const double z = quantile_of_centred(centred(random_pair(key, Purpose::Poisson, counter).first));
  return std::nearbyint(mean + std::sqrt(mean) * z);
}

}  // namespace gonio::random::detail
