#include "vector_math.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <cstring>
#include <vector>

#include "gonio/parallel/avx2.h"

namespace gonio::basis::detail {
namespace {

// Method of S. Moshier's Cephes library (logf, expf): reduction to a factor in
// [sqrt(1/2), sqrt(2)), minimax polynomial, logarithm of two in two parts.
GONIO_INLINE float log_of(float value) {
  constexpr std::uint32_t kSqrtHalf = 0x3f3504f3;
  const std::uint32_t bits = std::bit_cast<std::uint32_t>(value);
  const std::int32_t exponent = static_cast<std::int32_t>(bits - kSqrtHalf) >> 23;
  const float x = std::bit_cast<float>(bits - (static_cast<std::uint32_t>(exponent) << 23)) - 1.0f;
  const float e = static_cast<float>(exponent);

  float p = 7.0376836292e-2f;
  p = p * x - 1.1514610310e-1f;
  p = p * x + 1.1676998740e-1f;
  p = p * x - 1.2420140846e-1f;
  p = p * x + 1.4249322787e-1f;
  p = p * x - 1.6668057665e-1f;
  p = p * x + 2.0000714765e-1f;
  p = p * x - 2.4999993993e-1f;
  p = p * x + 3.3333331174e-1f;
  const float square = x * x;
  float y = p * square * x;
  y = y - 2.12194440e-4f * e;
  y = y - 0.5f * square;
  return (x + y) + 0.693359375f * e;
}

GONIO_INLINE float exp_of(float value) {
  const float clamped = value < -87.0f ? -87.0f : (value > 88.0f ? 88.0f : value);
  // Adding and taking away 1.5 * 2^23 rounds to the nearest whole number in the float itself.
  constexpr float kRounder = 12582912.0f;
  const float shifted = clamped * 1.44269504088896341f + kRounder;
  const float whole = shifted - kRounder;
  const float x = (clamped - whole * 0.693359375f) - whole * -2.12194440e-4f;

  float p = 1.9875691500e-4f;
  p = p * x + 1.3981999507e-3f;
  p = p * x + 8.3334519073e-3f;
  p = p * x + 4.1665795894e-2f;
  p = p * x + 1.6666665459e-1f;
  p = p * x + 5.0000001201e-1f;
  const float mantissa = (p * (x * x) + x) + 1.0f;
  const std::uint32_t exponent =
      (std::bit_cast<std::uint32_t>(shifted) - std::bit_cast<std::uint32_t>(kRounder) + 127u) << 23;
  return mantissa * std::bit_cast<float>(exponent);
}

GONIO_INLINE void log_loop(float* values, std::size_t count) {
  for (std::size_t i = 0; i < count; ++i) values[i] = log_of(values[i]);
}

GONIO_INLINE void exp_loop(float* values, std::size_t count) {
  for (std::size_t i = 0; i < count; ++i) values[i] = exp_of(values[i]);
}

GONIO_INLINE void add_loop(const float* values, std::size_t count, double* __restrict sums) {
  for (std::size_t i = 0; i < count; ++i) sums[i] += static_cast<double>(values[i]);
}

GONIO_INLINE void subtract_loop(const float* values, const float* mean, std::size_t count,
                                float* __restrict out) {
  for (std::size_t i = 0; i < count; ++i) out[i] = values[i] - mean[i];
}

constexpr std::size_t kLanes = 8;
/// One register with AVX2, two with SSE2: the same sums in the same order.
using Lanes = float __attribute__((vector_size(kLanes * sizeof(float))));

GONIO_INLINE float sum_of_lanes(const Lanes& lanes) {
  return ((lanes[0] + lanes[4]) + (lanes[2] + lanes[6])) +
         ((lanes[1] + lanes[5]) + (lanes[3] + lanes[7]));
}

GONIO_INLINE void expand_loop(const float* rows, const float* mean, std::size_t row_count,
                              std::size_t k, const float* coefficients, float* out_r, float* out_g,
                              float* out_b) {
  const std::size_t even = k / kLanes * kLanes;
  const float* const r = coefficients;
  const float* const g = coefficients + k;
  const float* const b = coefficients + 2 * k;
  for (std::size_t i = 0; i < row_count; ++i) {
    const float* const row = rows + i * k;
    Lanes lanes_r = {};
    Lanes lanes_g = {};
    Lanes lanes_b = {};
    for (std::size_t j = 0; j < even; j += kLanes) {
      Lanes q, c_r, c_g, c_b;
      std::memcpy(&q, row + j, sizeof q);
      std::memcpy(&c_r, r + j, sizeof c_r);
      std::memcpy(&c_g, g + j, sizeof c_g);
      std::memcpy(&c_b, b + j, sizeof c_b);
      lanes_r += q * c_r;
      lanes_g += q * c_g;
      lanes_b += q * c_b;
    }
    float sum_r = sum_of_lanes(lanes_r);
    float sum_g = sum_of_lanes(lanes_g);
    float sum_b = sum_of_lanes(lanes_b);
    for (std::size_t j = even; j < k; ++j) {
      sum_r += row[j] * r[j];
      sum_g += row[j] * g[j];
      sum_b += row[j] * b[j];
    }
    out_r[i] = mean[i] + sum_r;
    out_g[i] = mean[i] + sum_g;
    out_b[i] = mean[i] + sum_b;
  }
}

/// Rows whose products are summed in float before they go into the double sums.
constexpr std::size_t kProjectBlock = 64;

GONIO_INLINE void project_loop(const float* rows, std::size_t row_count, std::size_t k,
                               const float* res_r, const float* res_g, const float* res_b,
                               float* partial, double* sums) {
  for (std::size_t begin = 0; begin < row_count; begin += kProjectBlock) {
    const std::size_t end = std::min(begin + kProjectBlock, row_count);
    std::fill(partial, partial + 3 * k, 0.0f);
    for (std::size_t i = begin; i < end; ++i) {
      const float* const row = rows + i * k;
      const float r = res_r[i];
      const float g = res_g[i];
      const float b = res_b[i];
      float* __restrict const out_r = partial;
      float* __restrict const out_g = partial + k;
      float* __restrict const out_b = partial + 2 * k;
      for (std::size_t j = 0; j < k; ++j) {
        out_r[j] += row[j] * r;
        out_g[j] += row[j] * g;
        out_b[j] += row[j] * b;
      }
    }
    for (std::size_t j = 0; j < 3 * k; ++j) sums[j] += static_cast<double>(partial[j]);
  }
}

#if GONIO_WITH_AVX2
GONIO_TARGET_AVX2 void log_avx2(float* values, std::size_t count) { log_loop(values, count); }
GONIO_TARGET_AVX2 void exp_avx2(float* values, std::size_t count) { exp_loop(values, count); }
GONIO_TARGET_AVX2 void add_avx2(const float* values, std::size_t count, double* sums) {
  add_loop(values, count, sums);
}
GONIO_TARGET_AVX2 void subtract_avx2(const float* values, const float* mean, std::size_t count,
                                     float* out) {
  subtract_loop(values, mean, count, out);
}
GONIO_TARGET_AVX2 void expand_avx2(const float* rows, const float* mean, std::size_t row_count,
                                   std::size_t k, const float* coefficients, float* out_r,
                                   float* out_g, float* out_b) {
  expand_loop(rows, mean, row_count, k, coefficients, out_r, out_g, out_b);
}
GONIO_TARGET_AVX2 void project_avx2(const float* rows, std::size_t row_count, std::size_t k,
                                    const float* res_r, const float* res_g, const float* res_b,
                                    float* partial, double* sums) {
  project_loop(rows, row_count, k, res_r, res_g, res_b, partial, sums);
}
#endif

}  // namespace

void log_in_place(float* values, std::size_t count) {
#if GONIO_WITH_AVX2
  if (parallel::has_avx2()) return log_avx2(values, count);
#endif
  log_loop(values, count);
}

void exp_in_place(float* values, std::size_t count) {
#if GONIO_WITH_AVX2
  if (parallel::has_avx2()) return exp_avx2(values, count);
#endif
  exp_loop(values, count);
}

void add_to_sums(const float* values, std::size_t count, double* sums) {
#if GONIO_WITH_AVX2
  if (parallel::has_avx2()) return add_avx2(values, count, sums);
#endif
  add_loop(values, count, sums);
}

void subtract(const float* values, const float* mean, std::size_t count, float* out) {
#if GONIO_WITH_AVX2
  if (parallel::has_avx2()) return subtract_avx2(values, mean, count, out);
#endif
  subtract_loop(values, mean, count, out);
}

void expand_rows(const float* rows, const float* mean, std::size_t row_count, std::size_t k,
                 const float* coefficients, float* out_r, float* out_g, float* out_b) {
#if GONIO_WITH_AVX2
  if (parallel::has_avx2()) {
    return expand_avx2(rows, mean, row_count, k, coefficients, out_r, out_g, out_b);
  }
#endif
  expand_loop(rows, mean, row_count, k, coefficients, out_r, out_g, out_b);
}

void project_rows(const float* rows, std::size_t row_count, std::size_t k, const float* res_r,
                  const float* res_g, const float* res_b, double* sums) {
  std::vector<float> partial(3 * k);
#if GONIO_WITH_AVX2
  if (parallel::has_avx2()) {
    return project_avx2(rows, row_count, k, res_r, res_g, res_b, partial.data(), sums);
  }
#endif
  project_loop(rows, row_count, k, res_r, res_g, res_b, partial.data(), sums);
}

}  // namespace gonio::basis::detail
