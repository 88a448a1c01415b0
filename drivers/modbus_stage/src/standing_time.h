#pragma once

#include <chrono>

namespace gonio::modbus_stage {

/// Since when an axis has been standing, on the host's clock.
class StandingTime {
 public:
  bool longer_than(bool standing, std::chrono::milliseconds limit) {
    if (!standing || !standing_) since_ = std::chrono::steady_clock::now();
    standing_ = standing;
    return standing && std::chrono::steady_clock::now() - since_ > limit;
  }

 private:
  bool standing_ = false;
  std::chrono::steady_clock::time_point since_{};
};

}  // namespace gonio::modbus_stage
