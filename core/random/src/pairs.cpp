#include "pairs.h"

#include "wide.h"

#if GONIO_HAS_WIDE
#include <immintrin.h>
#endif

namespace gonio::random::detail {
namespace {

#if GONIO_HAS_WIDE

constexpr std::size_t kLanes = 4;
static_assert(kBatch % kLanes == 0);

#pragma GCC push_options
#pragma GCC target("avx2")

__m256i all(std::uint64_t word) { return _mm256_set1_epi64x(static_cast<std::int64_t>(word)); }

void store(std::uint64_t* to, __m256i lower, __m256i upper) {
  const __m256i low = _mm256_and_si256(lower, all(0xFFFFFFFFU));
  _mm256_storeu_si256(reinterpret_cast<__m256i*>(to),
                      _mm256_or_si256(low, _mm256_slli_epi64(upper, 32)));
}

/// Four blocks side by side, each 32-bit word in the lower half of 64 bits: a product looks at the
/// lower half only, so that nothing needs to be cleared before the end. Written by hand, because
/// compilers make three products of the one.
void random_pairs_by_four(Key key, Purpose purpose, std::uint64_t index, std::size_t count,
                          Pairs& pairs) {
  const __m256i multiplier0 = all(kPhiloxMultiplier0);
  const __m256i multiplier1 = all(kPhiloxMultiplier1);
  for (std::size_t at = 0; at < count; at += kLanes) {
    __m256i word0 = _mm256_add_epi64(all(index + at), _mm256_set_epi64x(3, 2, 1, 0));
    __m256i word1 = _mm256_srli_epi64(word0, 32);
    __m256i word2 = _mm256_setzero_si256();
    __m256i word3 = all(static_cast<std::uint32_t>(purpose));
    PhiloxKeys keys{
        {static_cast<std::uint32_t>(key.value), static_cast<std::uint32_t>(key.value >> 32U)}};
    for (int round = 0; round < kPhiloxRounds; ++round) {
      const __m256i product0 = _mm256_mul_epu32(multiplier0, word0);
      const __m256i product1 = _mm256_mul_epu32(multiplier1, word2);
      word0 = _mm256_xor_si256(_mm256_xor_si256(_mm256_srli_epi64(product1, 32), word1),
                               all(keys.words[0]));
      word2 = _mm256_xor_si256(_mm256_xor_si256(_mm256_srli_epi64(product0, 32), word3),
                               all(keys.words[1]));
      word1 = product1;
      word3 = product0;
      keys.next();
    }
    store(pairs.first.data() + at, word0, word1);
    store(pairs.second.data() + at, word2, word3);
  }
}

#pragma GCC pop_options

#endif

}  // namespace

void random_pairs(Key key, Purpose purpose, std::uint64_t index, std::size_t count, Pairs& pairs) {
#if GONIO_HAS_WIDE
  static const bool wide = __builtin_cpu_supports("avx2");
  if (wide) return random_pairs_by_four(key, purpose, index, count, pairs);
#endif
  for (std::size_t i = 0; i < count; ++i) {
    const Pair pair = random_pair(key, purpose, index + i);
    pairs.first[i] = pair.first;
    pairs.second[i] = pair.second;
  }
}

}  // namespace gonio::random::detail
