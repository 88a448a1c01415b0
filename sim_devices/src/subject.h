#pragma once

#include <cstdint>

namespace gonio::sim {

/// The index of a subject's first random value: room for 2^32 of them before the next subject's.
constexpr std::uint64_t first_index_of(std::uint64_t subject) { return subject << 32U; }

}  // namespace gonio::sim
