#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <mutex>
#include <string>

#include "gonio/devices/rotation_stage.h"

namespace gonio::devices {

/// What the driver of one axis is told by the rig file, whatever its protocol.
struct AxisSetup {
  std::string name;
  JointLimits limits;
  Angle home;  ///< joint angle of the home mark
  double max_speed_deg_per_s = 1.0;
  double acceleration_deg_per_s2 = 1.0;
  std::chrono::milliseconds settle{0};  ///< on the session's Clock, after the drive is in position

  /// Throws std::invalid_argument naming the field, what was found and what is expected.
  void validate() const;
};

/// The rules of RotationStage that do not depend on the protocol: limits, homing, and a stop that
/// latches. A driver asks it before it sends anything that moves.
///
/// Threads  latched(), stops() and what takes a Hold from any thread; the rest belongs to the
///          controlling thread.
class StageGate {
 public:
  /// While one lives, no other thread starts or stops motion.
  using Hold = std::unique_lock<std::mutex>;

  StageGate(std::string name, JointLimits limits);

  /// Taken to send a move; released after the last byte of it. Throws Stopped, NotHomed,
  /// LimitViolation (also for an angle that is not finite), in this order.
  Hold hold_for_move(Angle target);
  /// Taken to start homing; from here on the axis counts as not homed. Throws Stopped.
  Hold hold_for_homing();

  /// Latches at once, then waits for whoever holds: what has been sent by then is stopped by what
  /// the caller sends while he holds this.
  Hold hold_for_stop() noexcept;

  /// How many stops there were.
  std::uint64_t stops() const noexcept { return stops_; }
  bool latched() const noexcept { return stops_ != rearmed_; }
  /// Takes the latch back as of `stops`, which the caller read before he made sure that the axis
  /// stands. Throws Stopped when another one has come since; the latch then stays.
  void rearm(std::uint64_t stops);

  bool homed() const noexcept { return homed_; }
  void set_homed(bool homed) { homed_ = homed; }

  /// Throws Stopped while the latch is set: between the steps of anything that waits.
  void require_not_stopped() const;
  /// Throws Stopped or NotHomed.
  void require_ready() const;

  const std::string& name() const { return name_; }
  JointLimits limits() const { return limits_; }

 private:
  void require_homed() const;

  std::string name_;
  JointLimits limits_;
  std::mutex mutex_;
  std::atomic<std::uint64_t> stops_ = 0;
  std::atomic<std::uint64_t> rearmed_ = 0;  ///< of them
  std::atomic<bool> homed_ = false;
};

}  // namespace gonio::devices
