#include "gonio/monitor/thinned_series.h"

namespace gonio::monitor {

void ThinnedSeries::add(Value value) {
  last_ = value;
  if (seen_++ % stride_ != 0) return;
  if (kept_.size() == kMost) {
    for (std::size_t i = 0; 2 * i < kept_.size(); ++i) kept_[i] = kept_[2 * i];
    kept_.resize((kept_.size() + 1) / 2);
    stride_ *= 2;
    if ((seen_ - 1) % stride_ != 0) return;
  }
  kept_.push_back(value);
}

std::vector<ThinnedSeries::Value> ThinnedSeries::values() const {
  std::vector<Value> all = kept_;
  if (seen_ > 0 && all.back() != last_) all.push_back(last_);
  return all;
}

}  // namespace gonio::monitor
