#include "gonio/random/key.h"

#include "bits.h"

namespace gonio::random {
namespace {

/// FNV-1a, 64 bit: spreads names well enough to be the input of a strong mixer.
constexpr std::uint64_t hash_of(std::string_view text) {
  std::uint64_t hash = 0xCBF29CE484222325U;
  for (const char letter : text) {
    hash = (hash ^ static_cast<unsigned char>(letter)) * 0x100000001B3U;
  }
  return hash;
}

}  // namespace

Key make_key(std::uint64_t seed, std::string_view stream, std::uint64_t index) {
  // Philox itself mixes: first seed and name, then the result and the index.
  const Key family{detail::random_pair(Key{seed}, detail::Purpose::Key, hash_of(stream)).first};
  return Key{detail::random_pair(family, detail::Purpose::Key, index).first};
}

}  // namespace gonio::random
