#pragma once

#include <cstddef>

/// The small matrices of eight candidate poses at a time, entry by entry side by side ("lanes").
///
/// A symmetric q x q matrix of eight poses is stored as its lower triangle, row by row, eight
/// floats per entry. A column of products holds q entries of eight floats per group; the next
/// column follows `stride` floats later. Results are the same bits whichever instruction set is
/// taken: the lanes are independent and fused multiply-add is not used.
namespace gonio::design::lanes {

constexpr std::size_t kLanes = 8;
constexpr std::size_t kMaxRank = 9;

constexpr std::size_t triangle(std::size_t q) { return q * (q + 1) / 2; }

/// The q that the loops are compiled for which holds `rank` rows: 1, 4 or 9.
constexpr std::size_t padded_rank(std::size_t rank) { return rank <= 1 ? 1 : rank <= 4 ? 4 : 9; }

/// out = sum over columns of b b^T.
void gram(std::size_t q, const float* b, std::size_t stride, std::size_t columns, float* out);

/// v += sign p1 p1^T, w += sign (p1 p2^T + p2 p1^T); `columns` each of p1 and p2.
void update(std::size_t q, const float* p1, const float* p2, std::size_t stride,
            std::size_t columns, float sign, float* v, float* w);

/// gain[lane] = tr((1 + v)^-1 w).
void gain(std::size_t q, const float* v, const float* w, float* gain);

}  // namespace gonio::design::lanes
