#pragma once

#include <cstdint>

namespace gonio::sim {

/// The index of the first random value of a subject that was begun `before` times already, beyond
/// those drawn before there was any subject. Each time has room for 2^20 values, a subject for
/// 2^12 times.
constexpr std::uint64_t first_index_of(std::uint64_t subject, std::uint64_t before) {
  return ((subject + 1U) << 32U) | (before << 20U);
}

}  // namespace gonio::sim
