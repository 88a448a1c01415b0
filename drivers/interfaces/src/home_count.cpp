#include "gonio/devices/home_count.h"

#include <algorithm>

namespace gonio::devices {
namespace {

// More than two, because a drive answers now sooner, now later, and because a search may turn
// round.
constexpr std::size_t kReadings = 4;
constexpr double kRounding = 0.5;  // of a count, where it stood and at the mark

}  // namespace

void HomeCount::searching(double count, Time asked) {
  if (!last_.empty() && asked <= last_.back().asked) return;
  found_by_.reset();
  last_.push_back({count, asked});
  if (last_.size() > kReadings) last_.pop_front();
}

void HomeCount::searches_no_more(Time by) {
  if (!found_by_) found_by_ = by;
}

std::optional<HomeCount::Way> HomeCount::way_to_mark() const {
  if (last_.size() < kReadings || !found_by_) return std::nullopt;
  double slowest = 0.0;  // signed: a search that turned round may have turned once more
  double fastest = 0.0;
  for (std::size_t i = 1; i < last_.size(); ++i) {
    const double seconds = to_seconds(last_[i].asked - last_[i - 1].asked);
    const double speed = (last_[i].count - last_[i - 1].count) / seconds;
    slowest = std::min(slowest, speed);
    fastest = std::max(fastest, speed);
  }
  const double unseen_s = std::max(0.0, to_seconds(*found_by_ - last_.back().asked));
  const double nearest = last_.back().count + slowest * unseen_s;
  const double farthest = last_.back().count + fastest * unseen_s;
  return Way{0.5 * (nearest + farthest) - standing_, 0.5 * (farthest - nearest) + 2.0 * kRounding};
}

}  // namespace gonio::devices
