#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
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

/// Tails, all as if in the near one: out[i] for the probability less 1/2 q[i].
GONIO_WIDE void fill_quantiles_in_near_tail(std::span<const double> q, std::span<double> r,
                                            std::span<double> out) {
  for (std::size_t i = 0; i < q.size(); ++i) {
    r[i] = std::sqrt(-detail::log_of(0.5 - std::abs(q[i])));
    out[i] = std::copysign(detail::kNearTail(r[i] - detail::kNearTailShift), q[i]);
  }
}

/// Counting up of poisson_by_inversion(), side by side.
struct Inversions {
  static constexpr std::size_t kCount = 64;

  std::array<double, kCount> mean;
  std::array<double, kCount> probability;
  std::array<double, kCount> left;  // of u; -1 when the count is found
  std::array<double, kCount> k;
};

/// `left` is u as it is drawn.
GONIO_WIDE void count_up(Inversions& all) {
  for (std::size_t i = 0; i < Inversions::kCount; ++i) {
    all.probability[i] = detail::exp_of(-all.mean[i]);
    all.k[i] = 0.0;
  }
  for (std::size_t step = 1; step < detail::kReciprocals.size(); ++step) {
    const double reciprocal = detail::kReciprocals[step];
    std::uint64_t signs = ~std::uint64_t{0};
    for (std::size_t i = 0; i < Inversions::kCount; ++i) {
      const bool on = all.left[i] >= all.probability[i];
      all.left[i] = on ? all.left[i] - all.probability[i] : -1.0;
      all.k[i] += on ? 1.0 : 0.0;
      all.probability[i] *= all.mean[i] * reciprocal;
      signs &= std::bit_cast<std::uint64_t>(all.left[i]);
    }
    if (signs >> 63U != 0) break;  // all are found
  }
}

/// u[i] of the inversion, or -1 where it gives 0 at once, or -2 where the mean is not of that kind.
GONIO_WIDE void begin_inversions(std::span<const double> means, const detail::Pairs& pairs,
                                 std::span<double, kBatch> u) {
  for (std::size_t i = 0; i < means.size(); ++i) {
    const double drawn = detail::half_open(pairs.first[i]);
    const bool here = (means[i] >= 0.0) & (means[i] < detail::kInversionEnd);
    const double open = drawn < 1.0 - means[i] ? -1.0 : drawn;
    u[i] = here ? open : -2.0;
  }
}

/// drawn[i] = poisson_by_inversion() for means in [0, kInversionEnd); the others are left alone.
void invert(std::span<const double> means, const detail::Pairs& pairs,
            std::span<double, kBatch> drawn) {
  std::array<double, kBatch> u;
  begin_inversions(means, pairs, u);
  // Most dark pixels are done; the others are brought together.
  std::array<std::size_t, kBatch + 1> place;
  std::size_t open = 0;
  for (std::size_t i = 0; i < means.size(); ++i) {
    drawn[i] = u[i] == -1.0 ? 0.0 : drawn[i];
    place[open] = i;
    open += u[i] >= 0.0 ? 1 : 0;
  }
  Inversions some;
  for (std::size_t begin = 0; begin < open; begin += Inversions::kCount) {
    const std::size_t count = std::min(Inversions::kCount, open - begin);
    some.mean.fill(0.0);
    some.left.fill(-1.0);
    for (std::size_t i = 0; i < count; ++i) {
      some.mean[i] = means[place[begin + i]];
      some.left[i] = u[place[begin + i]];
    }
    count_up(some);
    for (std::size_t i = 0; i < count; ++i) drawn[place[begin + i]] = some.k[i];
  }
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

/// Attempts that need more than the quick look, side by side.
struct Attempts {
  std::array<double, kBatch> mean;
  detail::Pairs bits;
  std::array<double, kBatch> k;       // what is drawn; -1: refused at once
  std::array<double, kBatch> hurdle;  // see Attempt
  std::array<double, kBatch> log_factorial;
};

GONIO_WIDE void look_closely(Attempts& all, std::size_t count) {
  for (std::size_t i = 0; i < count; ++i) {
    const detail::Attempt drawn(all.mean[i], {all.bits.first[i], all.bits.second[i]});
    const double large = static_cast<double>(detail::kLogFactorials);
    all.k[i] = drawn.refused() ? -1.0 : drawn.k;
    all.hurdle[i] = drawn.quickly_accepted() ? -HUGE_VAL : drawn.hurdle(all.mean[i]);
    all.log_factorial[i] = detail::large_log_factorial(drawn.k > large ? drawn.k : large);
  }
}

/// The rest of poisson_by_rejection() for the `count` values at `place`, whose first attempts need
/// more than the quick look.
void reject(Key key, std::uint64_t first, std::span<const double> means, const detail::Pairs& pairs,
            std::span<std::size_t, kBatch + 1> place, std::size_t count,
            std::span<double, kBatch> drawn) {
  Attempts some;
  for (std::uint32_t round = 0; count > 0; ++round) {
    for (std::size_t i = 0; i < count; ++i) {
      const detail::Pair pair =
          round == 0 ? detail::Pair{pairs.first[place[i]], pairs.second[place[i]]}
                     : detail::random_pair(key, detail::Purpose::Poisson, first + place[i], round);
      some.mean[i] = means[place[i]];
      some.bits.first[i] = pair.first;
      some.bits.second[i] = pair.second;
    }
    look_closely(some, count);
    std::size_t left = 0;
    for (std::size_t i = 0; i < count; ++i) {
      const double k = some.k[i];
      const double log_factorial = k >= 0.0 && k < static_cast<double>(detail::kLogFactorials)
                                       ? detail::small_log_factorial(static_cast<std::size_t>(k))
                                       : some.log_factorial[i];
      const bool accepted = k >= 0.0 && some.hurdle[i] <= -log_factorial;
      drawn[place[i]] = accepted ? k : -1.0;
      place[left] = place[i];
      left += accepted ? 0 : 1;
    }
    count = left;
  }
}

}  // namespace

void fill_uniform(Key key, std::uint64_t first, std::span<double> out) {
  fill_words(key, detail::Purpose::Uniform, first, out, detail::half_open);
}

void fill_normal(Key key, std::uint64_t first, std::span<double> out) {
  std::array<double, kBatch> centred;
  std::array<std::size_t, kBatch> place;  // of the tails
  std::array<double, kBatch> tail;
  std::array<double, kBatch> r;
  std::array<double, kBatch> quantile;
  while (!out.empty()) {
    const std::span<double> some = out.first(std::min(kBatch, out.size()));
    const std::span<double> q = std::span(centred).first(some.size());
    fill_words(key, detail::Purpose::Normal, first, q, detail::centred);
    // First all as if in the centre, which the compiler can vectorise; then the tails, one in six.
    fill_quantiles_in_centre(q, some);
    std::size_t tails = 0;
    for (std::size_t i = 0; i < some.size(); ++i) {
      place[tails] = i;
      tail[tails] = q[i];
      tails += std::abs(q[i]) > detail::kCentreHalfWidth ? 1 : 0;
    }
    const std::span<const double> in_tail = std::span(tail).first(tails);
    fill_quantiles_in_near_tail(in_tail, std::span(r), std::span(quantile));
    for (std::size_t i = 0; i < tails; ++i) {
      some[place[i]] =
          r[i] <= detail::kNearTailEnd ? quantile[i] : detail::quantile_of_centred(tail[i]);
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
  std::array<std::size_t, kBatch + 1> place;
  for (std::size_t begin = 0; begin < out.size(); begin += kBatch) {
    const std::size_t count = std::min(kBatch, out.size() - begin);
    detail::random_pairs(key, detail::Purpose::Poisson, first + begin, count, pairs);
    const std::span<const double> some = means.subspan(begin, count);
    const auto [least, most] = std::minmax_element(some.begin(), some.end());
    const bool any_dark = !(*least >= detail::kInversionEnd);
    const bool any_bright = !(*most < detail::kInversionEnd);
    if (any_bright || !any_dark) {
      attempt(some, pairs, drawn);
      std::size_t open = 0;
      for (std::size_t i = 0; i < count; ++i) {
        place[open] = i;
        open += (drawn[i] < 0.0) & (some[i] >= detail::kInversionEnd) &
                        (some[i] <= detail::kRejectionEnd)
                    ? 1
                    : 0;
      }
      reject(key, first + begin, some, pairs, place, open, drawn);
    } else {
      drawn.fill(-1.0);
    }
    if (any_dark) invert(some, pairs, drawn);
    for (std::size_t i = 0; i < count; ++i) {
      out[begin + i] = drawn[i] >= 0.0 ? drawn[i]
                                       : detail::poisson_value(key, first + begin + i, some[i],
                                                               {pairs.first[i], pairs.second[i]});
    }
  }
}

}  // namespace gonio::random
