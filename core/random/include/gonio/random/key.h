#pragma once

#include <cstdint>
#include <string_view>

namespace gonio::random {

/// Names one sequence of random numbers. Made from a seed and a name, so that adding a use of
/// randomness somewhere never changes the numbers drawn elsewhere.
struct Key {
  std::uint64_t value = 0;

  friend constexpr bool operator==(const Key&, const Key&) = default;
};

/// The key of the sequence called `stream` under `seed`; `index` tells members of a family apart,
/// such as the frames of a session: make_key(seed, "camera.shot_noise", frame_id).
///
/// Different arguments give keys that coincide no more often than random 64-bit numbers do.
Key make_key(std::uint64_t seed, std::string_view stream, std::uint64_t index = 0);

}  // namespace gonio::random
