#include "row_products.h"

#include <algorithm>
#include <cstring>

#include "gonio/parallel/avx2.h"

namespace gonio::design {
namespace {

constexpr std::size_t kLanes = 8;

/// Eight sums side by side, in vectors no wider than a register of AVX2 (GCC keeps wider ones in
/// memory). Their order is the same whatever they are made of.
using EightFloats = float __attribute__((vector_size(8 * sizeof(float))));
using FourFloats = float __attribute__((vector_size(4 * sizeof(float))));
using FourDoubles = double __attribute__((vector_size(4 * sizeof(double))));

struct FloatLanes {
  EightFloats all = {};

  GONIO_INLINE void load(const float* from) { std::memcpy(&all, from, sizeof all); }
  GONIO_INLINE void add_product(const FloatLanes& a, const FloatLanes& b) { all += a.all * b.all; }
  GONIO_INLINE float sum() const {
    return ((all[0] + all[4]) + (all[2] + all[6])) + ((all[1] + all[5]) + (all[3] + all[7]));
  }
};

struct DoubleLanes {
  FourDoubles low = {};
  FourDoubles high = {};

  GONIO_INLINE void load(const double* from) {
    std::memcpy(&low, from, sizeof low);
    std::memcpy(&high, from + 4, sizeof high);
  }
  GONIO_INLINE void load(const float* from) {
    FourFloats single[2];
    std::memcpy(single, from, sizeof single);
    low = __builtin_convertvector(single[0], FourDoubles);
    high = __builtin_convertvector(single[1], FourDoubles);
  }
  GONIO_INLINE void add_product(const DoubleLanes& a, const DoubleLanes& b) {
    low += a.low * b.low;
    high += a.high * b.high;
  }
  GONIO_INLINE double sum() const {
    const FourDoubles both = low + high;
    return (both[0] + both[2]) + (both[1] + both[3]);
  }
};

/// `Vectors` products at a time: a single sum would wait for its own additions.
template <std::size_t Vectors, typename Lanes, typename Number>
GONIO_INLINE void some_products(const float* row, std::size_t k, const Number* vectors,
                                Number* out) {
  const std::size_t even = k / kLanes * kLanes;
  Lanes sums[Vectors];
  for (std::size_t at = 0; at < even; at += kLanes) {
    Lanes q;
    q.load(row + at);
    for (std::size_t v = 0; v < Vectors; ++v) {
      Lanes x;
      x.load(vectors + v * k + at);
      sums[v].add_product(q, x);
    }
  }
  if (even < k) {
    float row_rest[kLanes] = {};
    std::copy(row + even, row + k, row_rest);
    Lanes q;
    q.load(row_rest);
    for (std::size_t v = 0; v < Vectors; ++v) {
      Number rest[kLanes] = {};
      std::copy(vectors + v * k + even, vectors + (v + 1) * k, rest);
      Lanes x;
      x.load(rest);
      sums[v].add_product(q, x);
    }
  }
  for (std::size_t v = 0; v < Vectors; ++v) out[v] = sums[v].sum();
}

template <typename Lanes, typename Number>
GONIO_INLINE void products(const float* row, std::size_t k, const Number* vectors,
                           std::size_t count, Number* out) {
  std::size_t v = 0;
  for (; v + 2 <= count; v += 2) some_products<2, Lanes>(row, k, vectors + v * k, out + v);
  if (v < count) some_products<1, Lanes>(row, k, vectors + v * k, out + v);
}

#if GONIO_WITH_AVX2
GONIO_TARGET_AVX2 void products_avx2(const float* row, std::size_t k, const float* vectors,
                                     std::size_t count, float* out) {
  products<FloatLanes>(row, k, vectors, count, out);
}
GONIO_TARGET_AVX2 void products_avx2(const float* row, std::size_t k, const double* vectors,
                                     std::size_t count, double* out) {
  products<DoubleLanes>(row, k, vectors, count, out);
}
#endif

}  // namespace

void row_products(const float* row, std::size_t k, const float* vectors, std::size_t count,
                  float* out) {
#if GONIO_WITH_AVX2
  if (parallel::has_avx2()) return products_avx2(row, k, vectors, count, out);
#endif
  products<FloatLanes>(row, k, vectors, count, out);
}

void row_products(const float* row, std::size_t k, const double* vectors, std::size_t count,
                  double* out) {
#if GONIO_WITH_AVX2
  if (parallel::has_avx2()) return products_avx2(row, k, vectors, count, out);
#endif
  products<DoubleLanes>(row, k, vectors, count, out);
}

}  // namespace gonio::design
