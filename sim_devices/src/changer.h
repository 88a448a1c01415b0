#pragma once

#include <atomic>
#include <memory>
#include <string>
#include <vector>

#include "gonio/devices/target_changer.h"
#include "gonio/sim/joint.h"
#include "gonio/sim/virtual_clock.h"
#include "light.h"

namespace gonio::sim {

/// Swaps sample and white tile; takes virtual time. Refuses with Fault while an axis moves or the
/// lamp shines.
///
/// Threads  mount() on one; mounted() on any.
class SimTargetChanger final : public devices::TargetChanger {
 public:
  /// All must outlive it.
  SimTargetChanger(std::chrono::milliseconds change_time,
                   const std::vector<std::unique_ptr<Joint>>& joints, const SimLightSource& light,
                   VirtualClock& clock)
      : change_time_(change_time), joints_(joints), light_(light), clock_(clock) {}

  const std::string& name() const override { return name_; }
  devices::Target mounted() const override { return mounted_; }
  void mount(devices::Target target) override;

 private:
  std::chrono::milliseconds change_time_;
  const std::vector<std::unique_ptr<Joint>>& joints_;
  const SimLightSource& light_;
  VirtualClock& clock_;
  std::atomic<devices::Target> mounted_ = devices::Target::sample;
  std::string name_ = "target_changer";
};

}  // namespace gonio::sim
