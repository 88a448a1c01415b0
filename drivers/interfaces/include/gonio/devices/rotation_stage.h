#pragma once

#include <chrono>
#include <string>

#include "gonio/devices/device_error.h"
#include "gonio/units/angle.h"

namespace gonio::devices {

/// Where a joint may go, both ends inclusive.
struct JointLimits {
  Angle min;
  Angle max;
};

/// One motorised rotation axis.
///
/// Frame    Joint angle as the rig file counts it: counter-clockwise positive seen from the shaft
///          end; the home mark lies at the axis's `home` angle, which need not be 0 (a lamp arm has
///          no business at 0). Turning joints into theta/phi belongs to core/rig and calibration.
/// State    constructed -> home() -> ready; motion before home() throws NotHomed, unless the device
///          itself says that it is homed since it was switched on. stop() latches:
///          every motion throws Stopped until rearm(). A stop during a move keeps the axis homed.
/// Threads  One controlling thread. Only stop() may be called from any other.
/// Errors   DeviceError; its code() tells the scheduler whether to retry.
class RotationStage {
 public:
  virtual ~RotationStage() = default;
  RotationStage(const RotationStage&) = delete;
  RotationStage& operator=(const RotationStage&) = delete;

  /// The axis name of the rig file.
  virtual const std::string& name() const = 0;

  virtual JointLimits limits() const = 0;

  /// Finds the home mark and stands there, at the axis's home angle; returns when settled. May be
  /// repeated. After a failure the axis counts as not homed. Throws Timeout, Fault, Stopped.
  virtual void home(std::chrono::milliseconds timeout) = 0;

  /// Starts a move and returns at once, so several axes can travel together.
  /// A move still under way is replaced. Throws LimitViolation, without touching what is under
  /// way, when `target` is outside limits() or not finite; NotHomed; Stopped.
  virtual void begin_move_to(Angle target) = 0;

  /// Blocks until the encoder has settled and returns the angle it reports. Without a move begun it
  /// returns the present angle. A Timeout leaves the move running: wait again or stop().
  /// Throws Timeout, NotHomed, Stopped (a stop() came in between), Fault.
  virtual Angle wait_until_settled(std::chrono::milliseconds timeout) = 0;

  /// Brakes now and latches. Safe from any thread and from destructors.
  virtual void stop() noexcept = 0;

  /// Allows motion again after stop(). Throws Fault while an alarm stands; Stopped when another
  /// stop() came meanwhile, which stays latched.
  virtual void rearm() = 0;

 protected:
  RotationStage() = default;
};

}  // namespace gonio::devices
