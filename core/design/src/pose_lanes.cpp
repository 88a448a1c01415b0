#include "pose_lanes.h"

#include <cmath>

#include "gonio/parallel/avx2.h"

namespace gonio::design::lanes {
namespace {

/// Eight floats; the compiler maps them to what the instruction set has.
struct Vector {
  float lane[kLanes];
};

GONIO_INLINE void load(Vector& to, const float* from) {
  for (std::size_t l = 0; l < kLanes; ++l) to.lane[l] = from[l];
}
GONIO_INLINE void store(float* to, const Vector& from) {
  for (std::size_t l = 0; l < kLanes; ++l) to[l] = from.lane[l];
}
GONIO_INLINE void add_product(Vector& sum, const Vector& a, const Vector& b) {
  for (std::size_t l = 0; l < kLanes; ++l) sum.lane[l] += a.lane[l] * b.lane[l];
}
GONIO_INLINE void add_scaled(Vector& sum, const Vector& a, float factor) {
  for (std::size_t l = 0; l < kLanes; ++l) sum.lane[l] += a.lane[l] * factor;
}
GONIO_INLINE void subtract_product(Vector& sum, const Vector& a, const Vector& b) {
  for (std::size_t l = 0; l < kLanes; ++l) sum.lane[l] -= a.lane[l] * b.lane[l];
}
GONIO_INLINE void scale(Vector& a, const Vector& b) {
  for (std::size_t l = 0; l < kLanes; ++l) a.lane[l] *= b.lane[l];
}

/// Rows that go with the columns of a tile: as many sums as there are registers for.
constexpr std::size_t row_tile(std::size_t q) { return q == 6 ? 3 : q; }

template <std::size_t q>
GONIO_INLINE void multiply_loop(const float* rows, std::size_t k, const float* vectors,
                                std::size_t columns, float* out) {
  constexpr std::size_t kRows = row_tile(q);
  constexpr std::size_t kColumns = column_tile(q);
  for (std::size_t i = 0; i < q; i += kRows) {
    for (std::size_t c = 0; c < columns; c += kColumns) {
      Vector sums[kRows][kColumns] = {};
      for (std::size_t j = 0; j < k; ++j) {
        const float* const factors = vectors + c * k + j * kColumns;
        for (std::size_t r = 0; r < kRows; ++r) {
          Vector row;
          load(row, rows + (j * q + i + r) * kLanes);
          for (std::size_t t = 0; t < kColumns; ++t) add_scaled(sums[r][t], row, factors[t]);
        }
      }
      for (std::size_t r = 0; r < kRows; ++r) {
        for (std::size_t t = 0; t < kColumns; ++t) {
          store(out + ((c + t) * q + i + r) * kLanes, sums[r][t]);
        }
      }
    }
  }
}

template <std::size_t q>
GONIO_INLINE void gram_loop(const float* b, std::size_t columns, float* out) {
  for (std::size_t i = 0; i < q; ++i) {
    Vector sums[q] = {};
    for (std::size_t c = 0; c < columns; ++c) {
      const float* const column = b + c * q * kLanes;
      Vector at_i;
      load(at_i, column + i * kLanes);
      for (std::size_t j = 0; j <= i; ++j) {
        Vector at_j;
        load(at_j, column + j * kLanes);
        add_product(sums[j], at_i, at_j);
      }
    }
    for (std::size_t j = 0; j <= i; ++j) store(out + (triangle(i) + j) * kLanes, sums[j]);
  }
}

template <std::size_t q>
GONIO_INLINE void update_loop(const float* p1, const float* p2, std::size_t columns, float sign,
                              float* v, float* w) {
  for (std::size_t i = 0; i < q; ++i) {
    Vector sums_v[q] = {};
    Vector sums_w[q] = {};
    for (std::size_t c = 0; c < columns; ++c) {
      Vector one_i;
      Vector two_i;
      load(one_i, p1 + c * q * kLanes + i * kLanes);
      load(two_i, p2 + c * q * kLanes + i * kLanes);
      for (std::size_t j = 0; j <= i; ++j) {
        Vector one_j;
        Vector two_j;
        load(one_j, p1 + c * q * kLanes + j * kLanes);
        load(two_j, p2 + c * q * kLanes + j * kLanes);
        add_product(sums_v[j], one_i, one_j);
        add_product(sums_w[j], one_i, two_j);
        add_product(sums_w[j], two_i, one_j);
      }
    }
    for (std::size_t j = 0; j <= i; ++j) {
      const std::size_t at = (triangle(i) + j) * kLanes;
      for (std::size_t l = 0; l < kLanes; ++l) {
        v[at + l] += sign * sums_v[j].lane[l];
        w[at + l] += sign * sums_w[j].lane[l];
      }
    }
  }
}

/// With 1 + v = L L^T and X = L^-1: the sum over X's rows x of x^T w x.
template <std::size_t q>
GONIO_INLINE void gain_loop(const float* v, const float* w, float* gain) {
  Vector root[triangle(q)];    // L, then X in its place row by row
  Vector inverse_diagonal[q];  // 1 / L_ii
  for (std::size_t i = 0; i < q; ++i) {
    for (std::size_t j = 0; j <= i; ++j) {
      Vector sum;
      load(sum, v + (triangle(i) + j) * kLanes);
      if (i == j) {
        for (std::size_t l = 0; l < kLanes; ++l) sum.lane[l] += 1.0F;
      }
      for (std::size_t c = 0; c < j; ++c) {
        subtract_product(sum, root[triangle(i) + c], root[triangle(j) + c]);
      }
      if (i == j) {
        // Rounding must not make a root of a negative number; 1 + v is never below 1.
        for (std::size_t l = 0; l < kLanes; ++l) {
          const float square = sum.lane[l] > 1.0F ? sum.lane[l] : 1.0F;
          const float diagonal = std::sqrt(square);
          root[triangle(i) + i].lane[l] = diagonal;
          inverse_diagonal[i].lane[l] = 1.0F / diagonal;
        }
      } else {
        scale(sum, inverse_diagonal[j]);
        root[triangle(i) + j] = sum;
      }
    }
  }
  Vector inverse[triangle(q)];
  for (std::size_t i = 0; i < q; ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      Vector sum = {};
      for (std::size_t c = j; c < i; ++c) {
        subtract_product(sum, root[triangle(i) + c], inverse[triangle(c) + j]);
      }
      scale(sum, inverse_diagonal[i]);
      inverse[triangle(i) + j] = sum;
    }
    inverse[triangle(i) + i] = inverse_diagonal[i];
  }
  Vector total = {};
  for (std::size_t i = 0; i < q; ++i) {
    for (std::size_t j = 0; j <= i; ++j) {
      Vector product = {};  // (1 + v)^-1 at i, j
      for (std::size_t c = i; c < q; ++c) {
        add_product(product, inverse[triangle(c) + i], inverse[triangle(c) + j]);
      }
      Vector at;
      load(at, w + (triangle(i) + j) * kLanes);
      add_product(total, product, at);
      if (i != j) add_product(total, product, at);
    }
  }
  store(gain, total);
}

#if GONIO_WITH_AVX2
template <std::size_t q>
GONIO_TARGET_AVX2 void multiply_avx2(const float* rows, std::size_t k, const float* vectors,
                                     std::size_t columns, float* out) {
  multiply_loop<q>(rows, k, vectors, columns, out);
}
template <std::size_t q>
GONIO_TARGET_AVX2 void gram_avx2(const float* b, std::size_t columns, float* out) {
  gram_loop<q>(b, columns, out);
}
template <std::size_t q>
GONIO_TARGET_AVX2 void update_avx2(const float* p1, const float* p2, std::size_t columns,
                                   float sign, float* v, float* w) {
  update_loop<q>(p1, p2, columns, sign, v, w);
}
template <std::size_t q>
GONIO_TARGET_AVX2 void gain_avx2(const float* v, const float* w, float* gain) {
  gain_loop<q>(v, w, gain);
}

#define GONIO_DISPATCH(q, loop, ...) \
  (parallel::has_avx2() ? loop##_avx2<q>(__VA_ARGS__) : loop##_loop<q>(__VA_ARGS__))
#else
#define GONIO_DISPATCH(q, loop, ...) loop##_loop<q>(__VA_ARGS__)
#endif

}  // namespace

void multiply(std::size_t q, const float* rows, std::size_t k, const float* vectors,
              std::size_t columns, float* out) {
  if (q == 1) return GONIO_DISPATCH(1, multiply, rows, k, vectors, columns, out);
  if (q == 4) return GONIO_DISPATCH(4, multiply, rows, k, vectors, columns, out);
  GONIO_DISPATCH(6, multiply, rows, k, vectors, columns, out);
}

void gram(std::size_t q, const float* b, std::size_t columns, float* out) {
  if (q == 1) return GONIO_DISPATCH(1, gram, b, columns, out);
  if (q == 4) return GONIO_DISPATCH(4, gram, b, columns, out);
  GONIO_DISPATCH(6, gram, b, columns, out);
}

void update(std::size_t q, const float* p1, const float* p2, std::size_t columns, float sign,
            float* v, float* w) {
  if (q == 1) return GONIO_DISPATCH(1, update, p1, p2, columns, sign, v, w);
  if (q == 4) return GONIO_DISPATCH(4, update, p1, p2, columns, sign, v, w);
  GONIO_DISPATCH(6, update, p1, p2, columns, sign, v, w);
}

void gain(std::size_t q, const float* v, const float* w, float* result) {
  if (q == 1) return GONIO_DISPATCH(1, gain, v, w, result);
  if (q == 4) return GONIO_DISPATCH(4, gain, v, w, result);
  GONIO_DISPATCH(6, gain, v, w, result);
}

}  // namespace gonio::design::lanes
