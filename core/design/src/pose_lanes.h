#pragma once

#include <cstddef>

/// The small matrices of eight candidate poses at a time, entry by entry side by side ("lanes").
///
/// A symmetric q x q matrix of eight poses is stored as its lower triangle, row by row, eight
/// floats per entry; q x k rows and q x columns products column by column, eight floats per entry.
/// Results are the same bits whichever instruction set is taken: the lanes are independent and
/// fused multiply-add is not used. Not left to BLAS because the matrices are small: its packing
/// costs more than the products.
namespace gonio::design::lanes {

constexpr std::size_t kLanes = 8;
constexpr std::size_t kMaxRank = 6;

constexpr std::size_t triangle(std::size_t q) { return q * (q + 1) / 2; }

/// The q that the loops are compiled for which holds `rank` rows: 1, 4 or 6.
constexpr std::size_t padded_rank(std::size_t rank) { return rank <= 1 ? 1 : rank <= 4 ? 4 : 6; }

/// Columns that one pass over the rows multiplies; `columns` below are multiples of it.
constexpr std::size_t column_tile(std::size_t q) { return q == 6 ? 3 : 2; }

/// out (q x columns) = rows (q x k) * vectors (k x columns); the vectors in tiles of column_tile()
/// columns, each k x tile row by row.
void multiply(std::size_t q, const float* rows, std::size_t k, const float* vectors,
              std::size_t columns, float* out);

/// out = sum over columns of b b^T.
void gram(std::size_t q, const float* b, std::size_t columns, float* out);

/// v += sign p1 p1^T, w += sign (p1 p2^T + p2 p1^T); `columns` each of p1 and p2.
void update(std::size_t q, const float* p1, const float* p2, std::size_t columns, float sign,
            float* v, float* w);

/// gain[lane] = tr((1 + v)^-1 w).
void gain(std::size_t q, const float* v, const float* w, float* gain);

}  // namespace gonio::design::lanes
