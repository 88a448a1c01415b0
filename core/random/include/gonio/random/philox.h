#pragma once

#include <array>
#include <cstdint>

namespace gonio::random {

inline constexpr std::uint64_t kPhiloxMultiplier0 = 0xD2511F53U;
inline constexpr std::uint64_t kPhiloxMultiplier1 = 0xCD9E8D57U;
inline constexpr int kPhiloxRounds = 10;

/// The two keys of a round, Weyl sequences of the golden ratio and of sqrt(3) - 1.
struct PhiloxKeys {
  std::array<std::uint32_t, 2> words;

  constexpr void next() {
    words[0] += 0x9E3779B9U;
    words[1] += 0xBB67AE85U;
  }
};

/// Philox4x32-10, a counter-based generator: a fixed bijection of a 128-bit counter chosen by a
/// 64-bit key. There is no state, so any number of a sequence can be computed on its own, in any
/// order and on any thread.
///
/// Source   Salmon, Moraes, Dror, Shaw, "Parallel Random Numbers: As Easy as 1, 2, 3", SC 2011.
///          It passes BigCrush for any key (section 5 there).
constexpr std::array<std::uint32_t, 4> philox4x32_10(std::array<std::uint32_t, 4> counter,
                                                     std::array<std::uint32_t, 2> key) {
  PhiloxKeys keys{key};
  for (int round = 0; round < kPhiloxRounds; ++round) {
    const std::uint64_t product0 = kPhiloxMultiplier0 * counter[0];
    const std::uint64_t product1 = kPhiloxMultiplier1 * counter[2];
    counter = {static_cast<std::uint32_t>(product1 >> 32U) ^ counter[1] ^ keys.words[0],
               static_cast<std::uint32_t>(product1),
               static_cast<std::uint32_t>(product0 >> 32U) ^ counter[3] ^ keys.words[1],
               static_cast<std::uint32_t>(product0)};
    keys.next();
  }
  return counter;
}

}  // namespace gonio::random
