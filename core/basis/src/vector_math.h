#pragma once

#include <cstddef>

/// The inner loops over a million cells, compiled for several instruction sets.
///
/// Results are the same bits whichever is chosen: the lanes are independent, sums are kept in a
/// fixed number of lanes, and fused multiply-add is not used.
namespace gonio::basis::detail {

/// values[i] = ln(values[i]) for positive, normal, finite values. Within 1.5 ulp (float32).
void log_in_place(float* values, std::size_t count);

/// values[i] = exp(values[i]); arguments are clamped to [-87, 88]. Within 2 ulp (float32).
void exp_in_place(float* values, std::size_t count);

/// sums[i] += values[i]
void add_to_sums(const float* values, std::size_t count, double* sums);

/// out[i] = values[i] - mean[i]
void subtract(const float* values, const float* mean, std::size_t count, float* out);

/// out[c][i] = mean[i] + sum_j rows[i * k + j] * coefficients[c * k + j], three channels at once.
void expand_rows(const float* rows, const float* mean, std::size_t row_count, std::size_t k,
                 const float* coefficients, float* out_r, float* out_g, float* out_b);

/// sums[c * k + j] += sum_i rows[i * k + j] * residuals[c][i], three channels at once, in double.
void project_rows(const float* rows, std::size_t row_count, std::size_t k, const float* res_r,
                  const float* res_g, const float* res_b, double* sums);

}  // namespace gonio::basis::detail
