#include "gonio/usb_emulator/wire_log.h"

#include <algorithm>

namespace gonio::usb_emulator {

void WireLog::add(const std::string& device, TimePoint from, TimePoint to) {
  const std::lock_guard lock(mutex_);
  const auto last = std::find_if(intervals_.rbegin(), intervals_.rend(),
                                 [&](const Interval& known) { return known.device == device; });
  if (last != intervals_.rend() && from <= last->to) {
    last->to = std::max(last->to, to);
    return;
  }
  intervals_.push_back({device, from, to});
}

std::vector<WireLog::Interval> WireLog::intervals() const {
  const std::lock_guard lock(mutex_);
  std::vector<Interval> sorted = intervals_;
  std::stable_sort(sorted.begin(), sorted.end(),
                   [](const Interval& a, const Interval& b) { return a.from < b.from; });
  return sorted;
}

}  // namespace gonio::usb_emulator
