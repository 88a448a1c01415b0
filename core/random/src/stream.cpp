#include "gonio/random/stream.h"

#include <stdexcept>

#include "bits.h"
#include "gonio/random/distributions.h"

namespace gonio::random {

double Stream::uniform() { return random::uniform(key_, next_++); }

double Stream::normal() { return random::normal(key_, next_++); }

double Stream::poisson(double mean) { return random::poisson(key_, next_++, mean); }

std::uint64_t Stream::below(std::uint64_t bound) {
  if (bound == 0) throw std::invalid_argument("Stream::below: nothing is below 0");
  // The largest multiple of bound that fits; bits above it would favour small numbers.
  const std::uint64_t limit = max() - max() % bound;
  const std::uint64_t counter = next_++;
  for (std::uint32_t attempt = 0;; ++attempt) {
    const detail::Pair pair = detail::random_pair(key_, detail::Purpose::Bits, counter, attempt);
    if (pair.first < limit) return pair.first % bound;
    if (pair.second < limit) return pair.second % bound;
  }
}

std::uint64_t Stream::operator()() {
  return detail::random_pair(key_, detail::Purpose::Bits, next_++).first;
}

}  // namespace gonio::random
