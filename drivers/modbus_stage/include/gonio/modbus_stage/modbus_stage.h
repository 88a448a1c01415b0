#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "gonio/devices/clock.h"
#include "gonio/devices/home_count.h"
#include "gonio/devices/homing_report.h"
#include "gonio/devices/resettable_alarm.h"
#include "gonio/devices/rotation_stage.h"
#include "gonio/devices/stage_gate.h"
#include "gonio/modbus_bus/modbus_bus.h"
#include "gonio/modbus_stage/drive_profile.h"

namespace gonio::modbus_stage {

/// How the drive's steps turn the joint.
struct DriveScale {
  double steps_per_deg = 0.0;  ///< of the joint, gears included; above 0
  bool reversed = false;       ///< rising steps turn it clockwise
};

struct StageOptions {
  /// Registers that the profile calls unconfirmed and that the user has tried on this drive.
  std::vector<std::string> confirmed;
  /// The user has seen that this drive, told to home, counts on in its old zero until it says that
  /// it is home; no manual at hand says so. Then the axis tells where it stood before.
  bool counts_until_homed = false;
  Angle position_tolerance = Angle::from_degrees(0.02);  ///< of the feedback to the target
  std::chrono::milliseconds poll_interval{10};           ///< host's time
  /// Host's time that a standing axis may take to say that it has arrived.
  std::chrono::milliseconds arrival_patience{1000};
};

/// What a drive says of itself.
struct DriveState {
  bool fault = false;
  bool enabled = true;  ///< also where a drive does not say
  bool moving = false;
  bool arrived = false;    ///< command complete and in position, as far as the drive has the bits
  bool homed = true;       ///< also where a drive does not say
  std::int64_t steps = 0;  ///< feedback
};

class DriveLink;
struct MoveNumbers;

/// One axis of a Modbus drive.
///
/// Angle    home + steps / steps_per_deg, negated when reversed. What wait_until_settled() returns
///          is the drive's feedback, never its target.
/// State    As RotationStage; a drive that says it is homed is taken over without homing. An alarm,
///          a lost link and a drive that says it has lost its reference leave the axis not homed;
///          home() then identifies the drive again. So does silence, unless the drive can say that
///          it is homed still or has an absolute encoder. Before every move the drive is asked: one
///          that was switched off and on counts from elsewhere, and never starts an absolute move.
/// Time     Timeouts and settling are on the session's clock; the bus has its own deadlines.
/// Threads  As RotationStage. stop() is one attempt, and waits for one transaction of others at
///          most: within one response_timeout each and the time on the line (over TCP a connection
///          may have to be opened, within one more). Where it did not get through, rearm() and
///          require_standing() send it again.
/// Errors   As RotationStage. Fault also: an axis that stands short of its target or moves on after
///          a stop. Timeout also: a drive that stands and does not say that it has arrived.
class ModbusStage final : public devices::RotationStage,
                          public devices::ResettableAlarm,
                          public devices::HomingReport {
 public:
  /// Reads the drive's state and the settings that the profile counts on. `clock` outlives it.
  /// Throws std::invalid_argument: setup, profile or scale; an unconfirmed register that motion
  /// needs (naming it and the key `confirmed`); counts_until_homed of a drive that homes by its
  /// absolute encoder. DeviceError: nobody answers (Timeout,
  /// Disconnected), settings that differ (Protocol).
  ModbusStage(std::shared_ptr<modbus_bus::ModbusBus> bus, int unit, devices::AxisSetup setup,
              DriveProfile profile, DriveScale scale, devices::Clock& clock,
              StageOptions options = {});
  ~ModbusStage() override;

  const std::string& name() const override { return gate_.name(); }
  devices::JointLimits limits() const override { return gate_.limits(); }
  void home(std::chrono::milliseconds timeout) override;
  void begin_move_to(Angle target) override;
  Angle wait_until_settled(std::chrono::milliseconds timeout) override;
  void stop() noexcept override;
  void rearm() override;
  bool tells() const override { return options_.counts_until_homed; }
  std::optional<devices::StoodBeforeHome> stood_before_home() const override {
    return stood_before_home_;
  }

  /// Makes sure that the axis stands after stop(), which is sent if nobody has: again if it did not
  /// get through, then waits while the axis may still brake. Throws Fault when it moves on; as the
  /// bus when it cannot be told or asked. The latch stays.
  void require_standing();

  /// Clears the drive's alarm once a person has looked; throws Fault when it stands on. The axis is
  /// not homed afterwards.
  void reset_alarm() override;

  /// What the drive says now. Throws as the bus; Fault when the axis moves although a stop is
  /// latched and it had the time to brake.
  DriveState state();

 private:
  DriveState identify();
  void require_reference();
  void link_failed(devices::DeviceErrc code);
  void send_stop(modbus_bus::Attempts attempts);
  bool try_stop(modbus_bus::Attempts attempts) noexcept;
  void release_stop(const std::function<bool()>& given_up);
  std::function<bool()> unless_stopped() const;

  void require_sound(const DriveState& state);
  void require_following();
  std::string standing_text(const DriveState& state) const;

  void note_move(std::int32_t steps);
  bool on_target(const DriveState& state) const;
  void make_ready_for_homing();
  /// `count` is told what is read meanwhile; may be null.
  void wait_for_home(devices::Clock::Duration deadline, devices::HomeCount* count);
  void note_where_it_stood(const devices::HomeCount& count);
  void settle(devices::Clock::Duration deadline);
  void wait_until_standing();
  [[noreturn]] void fail(devices::DeviceErrc code, const std::string& message) const;

  MoveNumbers numbers_to(std::int32_t steps) const;
  Angle angle_from_steps(std::int64_t steps) const;
  std::int32_t steps_from_angle(Angle angle) const;

  devices::AxisSetup setup_;
  double steps_per_deg_;  ///< negative when reversed
  devices::Clock& clock_;
  StageOptions options_;
  devices::StageGate gate_;
  std::unique_ptr<DriveLink> link_;
  const DriveProfile& profile_;            ///< the link's
  devices::Clock::Duration braking_time_;  ///< that a stop may take, with a margin
  std::int64_t speed_ = 0;                 ///< in the drive's units
  std::int64_t acceleration_ = 0;
  std::int64_t tolerance_steps_ = 0;
  bool identified_ = false;
  std::optional<std::int32_t> target_steps_;          ///< of the move begun last
  std::chrono::steady_clock::time_point moved_at_{};  ///< when it was sent, on the host's clock
  bool started_ = false;                              ///< the drive's status is of this move
  bool settled_ = false;                              ///< since then
  std::optional<devices::StoodBeforeHome> stood_before_home_;
  /// A stop may have to be released. So it is at first: another process, a watchdog for one, may
  /// have sent it.
  std::atomic<bool> stop_set_ = true;
  std::atomic<bool> stop_failed_ = false;  ///< the last one
  std::atomic<devices::Clock::Duration> stopped_at_{};
};

}  // namespace gonio::modbus_stage
