#include "line_turn.h"

namespace gonio::modbus_bus {

LineTurn::Hold LineTurn::take(bool urgent) {
  std::unique_lock lock(mutex_);
  if (urgent) {
    ++urgent_waiting_;
    changed_.wait(lock, [this] { return !taken_; });
    --urgent_waiting_;
  } else {
    while (true) {
      changed_.wait(lock, [this] { return !taken_ && urgent_waiting_ == 0; });
      if (std::chrono::steady_clock::now() >= quiet_until_) break;
      changed_.wait_until(lock, quiet_until_);
    }
  }
  taken_ = true;
  return Hold(*this);
}

void LineTurn::keep_quiet_until(TimePoint time) {
  const std::lock_guard lock(mutex_);
  quiet_until_ = time;
}

void LineTurn::give_back() {
  {
    const std::lock_guard lock(mutex_);
    taken_ = false;
  }
  changed_.notify_all();
}

}  // namespace gonio::modbus_bus
