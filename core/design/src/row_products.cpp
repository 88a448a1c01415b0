#include "row_products.h"

namespace gonio::design {
namespace {

constexpr std::size_t kLanes = 8;

template <typename Number>
Number product(const float* row, std::size_t k, const Number* vector) {
  Number sums[kLanes] = {};
  std::size_t at = 0;
  for (; at + kLanes <= k; at += kLanes) {
    for (std::size_t lane = 0; lane < kLanes; ++lane) {
      sums[lane] += static_cast<Number>(row[at + lane]) * vector[at + lane];
    }
  }
  for (std::size_t lane = 0; at < k; ++at, ++lane) {
    sums[lane] += static_cast<Number>(row[at]) * vector[at];
  }
  return ((sums[0] + sums[4]) + (sums[2] + sums[6])) + ((sums[1] + sums[5]) + (sums[3] + sums[7]));
}

template <typename Number>
void products(const float* row, std::size_t k, const Number* vectors, std::size_t count,
              Number* out) {
  for (std::size_t v = 0; v < count; ++v) out[v] = product(row, k, vectors + v * k);
}

}  // namespace

void row_products(const float* row, std::size_t k, const float* vectors, std::size_t count,
                  float* out) {
  products(row, k, vectors, count, out);
}

void row_products(const float* row, std::size_t k, const double* vectors, std::size_t count,
                  double* out) {
  products(row, k, vectors, count, out);
}

}  // namespace gonio::design
