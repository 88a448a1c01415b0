#pragma once

#include <cstdint>

#include "gonio/random/key.h"

namespace gonio::random {

/// One sequence read in order, for code without a natural counter (shuffles, search moves).
///
/// The n-th call, whatever it asks for, uses counter n: uniform() as the n-th call equals
/// random::uniform(key, n). Satisfies UniformRandomBitGenerator.
///
/// Threads  One thread per object; copies continue independently, with the same numbers.
class Stream {
 public:
  using result_type = std::uint64_t;

  explicit Stream(Key key) : key_(key) {}

  double uniform();             ///< As random::uniform().
  double normal();              ///< As random::normal().
  double poisson(double mean);  ///< As random::poisson().

  /// A whole number in [0, bound), every one equally likely.
  /// Throws std::invalid_argument if `bound` is 0.
  std::uint64_t below(std::uint64_t bound);

  /// 64 random bits.
  std::uint64_t operator()();
  static constexpr std::uint64_t min() { return 0; }
  static constexpr std::uint64_t max() { return ~std::uint64_t{0}; }

 private:
  Key key_;
  std::uint64_t next_ = 0;
};

}  // namespace gonio::random
