#pragma once

#include <atomic>
#include <functional>
#include <stop_token>
#include <string>

#include "gonio/console/console.h"
#include "gonio/devices/target_changer.h"

namespace gonio::cli {

/// A rig's own changer that says what a session which was stopped still waits for: the changer
/// cannot be told to stop. Axes and shutter are, by others, at the same time.
///
/// Threads  As TargetChanger; the stop may come from any.
class ChangerWait final : public devices::TargetChanger {
 public:
  /// `changer` and `console` must outlive it.
  ChangerWait(devices::TargetChanger& changer, const Console& console, const std::stop_token& stop)
      : changer_(changer), console_(console), stop_(stop), on_stop_(stop, [this] {
          if (moves_) tell();
        }) {}

  const std::string& name() const override { return changer_.name(); }
  devices::Target mounted() const override { return changer_.mounted(); }
  void mount(devices::Target target) override;

 private:
  void tell();  ///< once

  devices::TargetChanger& changer_;
  const Console& console_;
  std::stop_token stop_;
  std::atomic<bool> moves_ = false;
  std::atomic<bool> told_ = false;
  std::stop_callback<std::function<void()>> on_stop_;  ///< last: the others must be there
};

}  // namespace gonio::cli
