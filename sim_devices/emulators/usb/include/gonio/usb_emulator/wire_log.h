#pragma once

#include <chrono>
#include <mutex>
#include <string>
#include <vector>

namespace gonio::usb_emulator {

/// When bytes were on a wire, in the host's time: for telling a session's overhead from what the
/// line itself takes.
///
/// Threads  All members from any thread.
class WireLog {
 public:
  using TimePoint = std::chrono::steady_clock::time_point;

  struct Interval {
    std::string device;
    TimePoint from;
    TimePoint to;
  };

  void add(const std::string& device, TimePoint from, TimePoint to);
  /// In order of their begin; intervals of one device that touch are one.
  std::vector<Interval> intervals() const;

 private:
  mutable std::mutex mutex_;
  std::vector<Interval> intervals_;
};

}  // namespace gonio::usb_emulator
