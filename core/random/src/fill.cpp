#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <stdexcept>

#include "bits.h"
#include "gonio/random/distributions.h"
#include "normal.h"
#include "pairs.h"
#include "poisson.h"
#include "wide.h"

namespace gonio::random {
namespace {

using detail::kBatch;

/// out[i] = convert(random word of counter first + i): two counters share a Philox block.
template <typename Convert>
void fill_words(Key key, detail::Purpose purpose, std::uint64_t first, std::span<double> out,
                Convert&& convert) {
  std::size_t at = 0;
  if (first % 2 == 1 && !out.empty()) {
    out[at++] = convert(detail::random_word(key, purpose, first));
  }
  detail::Pairs pairs;
  while (at + 1 < out.size()) {
    const std::size_t blocks = std::min(kBatch, (out.size() - at) / 2);
    detail::random_pairs(key, purpose, (first + at) / 2, blocks, pairs);
    for (std::size_t i = 0; i < blocks; ++i, at += 2) {
      out[at] = convert(pairs.first[i]);
      out[at + 1] = convert(pairs.second[i]);
    }
  }
  if (at < out.size()) out[at] = convert(detail::random_word(key, purpose, first + at));
}

GONIO_WIDE void fill_quantiles_in_centre(std::span<const double> q, std::span<double> out) {
  for (std::size_t i = 0; i < q.size(); ++i) out[i] = detail::quantile_in_centre(q[i]);
}

/// First attempts of the rejection: what each draws, or -1 where its mean is not drawn so or where
/// more than the quick look is needed.
GONIO_WIDE void attempt(std::span<const double> means, const detail::Pairs& pairs,
                        std::span<double, kBatch> drawn) {
  for (std::size_t i = 0; i < means.size(); ++i) {
    const double mean = means[i];
    const detail::Attempt first(mean, {pairs.first[i], pairs.second[i]});
    const bool good = (mean >= detail::kInversionEnd) & (mean <= detail::kRejectionEnd) &
                      first.quickly_accepted();
    drawn[i] = good ? first.k : -1.0;
  }
}

}  // namespace

void fill_uniform(Key key, std::uint64_t first, std::span<double> out) {
  fill_words(key, detail::Purpose::Uniform, first, out, detail::half_open);
}

void fill_normal(Key key, std::uint64_t first, std::span<double> out) {
  std::array<double, kBatch> centred;
  while (!out.empty()) {
    const std::span<double> some = out.first(std::min(kBatch, out.size()));
    const std::span<double> q = std::span(centred).first(some.size());
    fill_words(key, detail::Purpose::Normal, first, q, detail::centred);
    // First all as if in the centre, which the compiler can vectorise; then the tails, one in six.
    fill_quantiles_in_centre(q, some);
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
  detail::Pairs pairs;
  std::array<double, kBatch> drawn;
  for (std::size_t begin = 0; begin < out.size(); begin += kBatch) {
    const std::size_t count = std::min(kBatch, out.size() - begin);
    detail::random_pairs(key, detail::Purpose::Poisson, first + begin, count, pairs);
    attempt(means.subspan(begin, count), pairs, drawn);
    for (std::size_t i = 0; i < count; ++i) {
      out[begin + i] = drawn[i] >= 0.0
                           ? drawn[i]
                           : detail::poisson_value(key, first + begin + i, means[begin + i],
                                                   {pairs.first[i], pairs.second[i]});
    }
  }
}

}  // namespace gonio::random
