#pragma once

#include <chrono>
#include <cstddef>
#include <deque>
#include <mutex>
#include <vector>

namespace gonio::modbus_emulator {

/// When bytes were on a line, or would have been on a real one: on the host's clock, for figures of
/// how much of a session the wire takes.
///
/// Threads  All members from any thread.
class WireLog {
 public:
  using TimePoint = std::chrono::steady_clock::time_point;
  struct Interval {
    TimePoint from;
    TimePoint to;
  };
  static constexpr std::size_t kKept = 1'000'000;  ///< the latest

  void add(TimePoint from, TimePoint to);
  /// Rising, not overlapping.
  std::vector<Interval> intervals() const;

 private:
  mutable std::mutex mutex_;
  std::deque<Interval> intervals_;
};

}  // namespace gonio::modbus_emulator
