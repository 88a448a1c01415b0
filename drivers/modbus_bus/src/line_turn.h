#pragma once

#include <condition_variable>
#include <mutex>

namespace gonio::modbus_bus {

/// Whose turn it is on a line: one at a time, urgent ones first.
///
/// Threads  All members from any thread.
class LineTurn {
 public:
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

  Hold take(bool urgent);

  /// Whether somebody urgent waits.
  bool urgent_waits() const;

 private:
  void give_back();

  mutable std::mutex mutex_;
  std::condition_variable changed_;
  bool taken_ = false;
  int urgent_waiting_ = 0;
};

}  // namespace gonio::modbus_bus
