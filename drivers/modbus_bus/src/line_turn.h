#pragma once

#include <chrono>
#include <condition_variable>
#include <mutex>

namespace gonio::modbus_bus {

/// Whose turn it is on a line: one at a time, urgent ones first.
///
/// Threads  All members from any thread.
class LineTurn {
 public:
  using TimePoint = std::chrono::steady_clock::time_point;

  /// The turn; given back by its destructor.
  class Hold {
   public:
    explicit Hold(LineTurn& turn) : turn_(&turn) {}
    Hold(const Hold&) = delete;
    Hold& operator=(const Hold&) = delete;
    ~Hold() { turn_->give_back(); }

   private:
    LineTurn* turn_;
  };

  /// Waits for the turn. Who is not urgent also waits until the line may be used again.
  Hold take(bool urgent);

  /// Nobody but urgent ones gets the turn before `time`.
  void keep_quiet_until(TimePoint time);

 private:
  void give_back();

  std::mutex mutex_;
  std::condition_variable changed_;
  bool taken_ = false;
  int urgent_waiting_ = 0;
  TimePoint quiet_until_{};
};

}  // namespace gonio::modbus_bus
