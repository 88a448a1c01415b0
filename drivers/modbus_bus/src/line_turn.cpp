#include "line_turn.h"

namespace gonio::modbus_bus {

LineTurn::Hold LineTurn::take(bool urgent) {
  std::unique_lock lock(mutex_);
  if (urgent) {
    ++urgent_waiting_;
    changed_.wait(lock, [this] { return !taken_; });
    --urgent_waiting_;
  } else {
    changed_.wait(lock, [this] { return !taken_ && urgent_waiting_ == 0; });
  }
  taken_ = true;
  return Hold(*this);
}

bool LineTurn::urgent_waits() const {
  const std::lock_guard lock(mutex_);
  return urgent_waiting_ > 0;
}

void LineTurn::give_back() {
  {
    const std::lock_guard lock(mutex_);
    taken_ = false;
  }
  changed_.notify_all();
}

}  // namespace gonio::modbus_bus
