#pragma once

#include <mutex>
#include <string>

#include "gonio/devices/rotation_stage.h"
#include "gonio/sim/joint.h"
#include "gonio/sim/virtual_clock.h"

namespace gonio::sim {

/// The drive of one joint: homing, soft limits and the stop latch.
///
/// A timeout is in virtual time and lets that time pass.
class SimRotationStage final : public devices::RotationStage {
 public:
  /// Both must outlive the stage.
  SimRotationStage(const rig::Axis& axis, Joint& joint, VirtualClock& clock);

  const std::string& name() const override { return name_; }
  devices::JointLimits limits() const override { return limits_; }
  void home(std::chrono::milliseconds timeout) override;
  void begin_move_to(Angle target) override;
  Angle wait_until_settled(std::chrono::milliseconds timeout) override;
  void stop() noexcept override;
  void rearm() override;

 private:
  bool stopped() const;
  void refuse_when_stopped() const;
  void refuse_when_not_homed() const;
  void wait_for(devices::Clock::Duration settled, std::chrono::milliseconds timeout,
                const char* what);

  std::string name_;
  devices::JointLimits limits_;
  Joint& joint_;
  VirtualClock& clock_;
  mutable std::mutex mutex_;  ///< guards the latch, and a start of motion against a stop()
  bool stopped_ = false;
  bool homed_ = false;  ///< of the controlling thread
};

}  // namespace gonio::sim
