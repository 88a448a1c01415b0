#include <algorithm>
#include <cmath>
#include <cstddef>
#include <stdexcept>

#include "bits.h"
#include "gonio/random/distributions.h"
#include "normal.h"
#include "poisson.h"

namespace gonio::random {
namespace {

/// out[i] = convert(random word of counter first + i), a Philox block at a time.
template <typename Convert>
void fill_words(Key key, detail::Purpose purpose, std::uint64_t first, std::span<double> out,
                Convert&& convert) {
  std::size_t at = 0;
  if (first % 2 == 1 && !out.empty()) {
    out[at++] = convert(detail::random_word(key, purpose, first));
  }
  for (; at + 1 < out.size(); at += 2) {
    const detail::Pair pair = detail::random_pair(key, purpose, (first + at) / 2);
    out[at] = convert(pair.first);
    out[at + 1] = convert(pair.second);
  }
  if (at < out.size()) out[at] = convert(detail::random_word(key, purpose, first + at));
}

}  // namespace

void fill_uniform(Key key, std::uint64_t first, std::span<double> out) {
  fill_words(key, detail::Purpose::Uniform, first, out, detail::half_open);
}

void fill_normal(Key key, std::uint64_t first, std::span<double> out) {
  constexpr std::size_t kBatch = 512;  // stays in the first-level cache
  std::array<double, kBatch> centred;
  while (!out.empty()) {
    const std::span<double> some = out.first(std::min(kBatch, out.size()));
    const std::span<double> q = std::span(centred).first(some.size());
    fill_words(key, detail::Purpose::Normal, first, q, detail::centred);
    // First all as if in the centre, which the compiler can vectorise; then the tails, one in six.
    for (std::size_t i = 0; i < some.size(); ++i) some[i] = detail::quantile_in_centre(q[i]);
    for (std::size_t i = 0; i < some.size(); ++i) {
      if (std::abs(q[i]) > detail::kCentreHalfWidth) some[i] = detail::quantile_of_centred(q[i]);
    }
    first += some.size();
    out = out.subspan(some.size());
  }
}

void fill_poisson(Key key, std::uint64_t first, std::span<const double> means,
                  std::span<double> out) {
  if (means.size() != out.size()) {
    throw std::invalid_argument("fill_poisson: as many means as numbers are needed");
  }
  for (std::size_t i = 0; i < out.size(); ++i) {
    out[i] = detail::poisson_value(key, first + i, means[i]);
  }
}

}  // namespace gonio::random
