#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "bits.h"

namespace gonio::random::detail {

/// So many values are drawn at a time: what they need stays in the first-level cache.
inline constexpr std::size_t kBatch = 512;

/// random_pair() of kBatch indices, one member an array.
struct Pairs {
  std::array<std::uint64_t, kBatch> first;
  std::array<std::uint64_t, kBatch> second;
};

/// pairs.first[i], pairs.second[i] = random_pair(key, purpose, index + i) for i < count at least.
void random_pairs(Key key, Purpose purpose, std::uint64_t index, std::size_t count, Pairs& pairs);

}  // namespace gonio::random::detail
