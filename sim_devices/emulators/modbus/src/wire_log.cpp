#include "gonio/modbus_emulator/wire_log.h"

#include <algorithm>

namespace gonio::modbus_emulator {

void WireLog::add(TimePoint from, TimePoint to) {
  const std::lock_guard lock(mutex_);
  if (!intervals_.empty()) from = std::max(from, intervals_.back().to);
  if (to <= from) return;
  intervals_.push_back({from, to});
  if (intervals_.size() > kKept) intervals_.pop_front();
}

std::vector<WireLog::Interval> WireLog::intervals() const {
  const std::lock_guard lock(mutex_);
  return {intervals_.begin(), intervals_.end()};
}

}  // namespace gonio::modbus_emulator
