#pragma once

#include <array>
#include <bit>
#include <cstdint>

#include "gonio/random/key.h"
#include "gonio/random/philox.h"

/// How counters and distributions share a key's 2^128 blocks of four words.
namespace gonio::random::detail {

/// The last word of the Philox counter; changing a value changes every number drawn.
enum class Purpose : std::uint32_t { Uniform = 0, Normal = 1, Poisson = 2, Bits = 3, Key = 4 };

/// 128 random bits as two 64-bit words.
struct Pair {
  std::uint64_t first;
  std::uint64_t second;
};

/// `attempt` numbers the draws of one value where a value may need several.
inline Pair random_pair(Key key, Purpose purpose, std::uint64_t index, std::uint32_t attempt = 0) {
  const auto low = [](std::uint64_t word) { return static_cast<std::uint32_t>(word); };
  const auto high = [](std::uint64_t word) { return static_cast<std::uint32_t>(word >> 32U); };
  const std::array<std::uint32_t, 4> words =
      philox4x32_10({low(index), high(index), attempt, static_cast<std::uint32_t>(purpose)},
                    {low(key.value), high(key.value)});
  return {words[0] | (std::uint64_t{words[1]} << 32U), words[2] | (std::uint64_t{words[3]} << 32U)};
}

/// The 64 bits of one counter where a value needs no more: two counters share a block.
inline std::uint64_t random_word(Key key, Purpose purpose, std::uint64_t counter) {
  const Pair pair = random_pair(key, purpose, counter / 2);
  return counter % 2 == 0 ? pair.first : pair.second;
}

/// The upper 52 bits as a double of [1, 2). From whole numbers to doubles compilers know no vectors
/// before AVX-512; from bits to bits they do.
inline double between_one_and_two(std::uint64_t bits) {
  return std::bit_cast<double>(std::uint64_t{0x3FF0'0000'0000'0000} | (bits >> 12U));
}

/// [0, 1) in steps of 2^-53: all a double can hold below 1. No operation rounds.
inline double half_open(std::uint64_t bits) {
  const std::uint64_t all_if_odd = std::uint64_t{0} - ((bits >> 11U) & 1U);
  const double last_step =
      std::bit_cast<double>(all_if_odd & std::bit_cast<std::uint64_t>(0x1p-53));
  return (between_one_and_two(bits) - 1.0) + last_step;
}

/// The middles of 2^52 steps of (0, 1), less 1/2: never +-1/2, and symmetric about zero. No
/// operation rounds.
inline double centred(std::uint64_t bits) { return (between_one_and_two(bits) - 1.5) + 0x1p-53; }

}  // namespace gonio::random::detail
