#pragma once

#include <string>

#include "gonio/devices/homing_report.h"
#include "gonio/devices/rotation_stage.h"
#include "gonio/devices/stage_gate.h"
#include "gonio/sim/joint.h"
#include "gonio/sim/virtual_clock.h"

namespace gonio::sim {

/// The drive of one joint: homing, soft limits and the stop latch.
///
/// A timeout is in virtual time and lets that time pass.
class SimRotationStage final : public devices::RotationStage, public devices::HomingReport {
 public:
  /// Joint and clock must outlive the stage. `tells`: HomingReport.
  SimRotationStage(const rig::Axis& axis, Joint& joint, VirtualClock& clock, bool tells);

  const std::string& name() const override { return gate_.name(); }
  devices::JointLimits limits() const override { return gate_.limits(); }
  void home(std::chrono::milliseconds timeout) override;
  void begin_move_to(Angle target) override;
  Angle wait_until_settled(std::chrono::milliseconds timeout) override;
  void stop() noexcept override;
  void rearm() override;
  bool tells() const override { return tells_; }
  std::optional<devices::StoodBeforeHome> stood_before_home() const override;

 private:
  void wait_for(devices::Clock::Duration settled, std::chrono::milliseconds timeout,
                const char* what);

  devices::StageGate gate_;
  Joint& joint_;
  VirtualClock& clock_;
  bool tells_;
};

}  // namespace gonio::sim
