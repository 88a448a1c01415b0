#include "gonio/random/distributions.h"

#include <algorithm>
#include <stdexcept>

#include "bits.h"
#include "normal.h"
#include "poisson.h"

namespace gonio::random {

double uniform(Key key, std::uint64_t counter) {
  return detail::half_open(detail::random_word(key, detail::Purpose::Uniform, counter));
}

double normal(Key key, std::uint64_t counter) {
  return detail::quantile_of_centred(
      detail::centred(detail::random_word(key, detail::Purpose::Normal, counter)));
}

double poisson(Key key, std::uint64_t counter, double mean) {
  return detail::poisson_value(key, counter, mean,
                               detail::random_pair(key, detail::Purpose::Poisson, counter));
}

double normal_quantile(double probability) {
  if (!(probability > 0.0 && probability < 1.0)) {
    throw std::invalid_argument("normal_quantile: a probability lies between 0 and 1");
  }
  const double q = probability - 0.5;
  return std::abs(q) <= detail::kCentreHalfWidth
             ? detail::quantile_in_centre(q)
             : detail::quantile_in_tail(q, std::min(probability, 1.0 - probability));
}

}  // namespace gonio::random
