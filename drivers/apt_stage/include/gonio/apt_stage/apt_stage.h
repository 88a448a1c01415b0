#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "gonio/apt_stage/apt_model.h"
#include "gonio/devices/clock.h"
#include "gonio/devices/home_count.h"
#include "gonio/devices/homing_report.h"
#include "gonio/devices/rotation_stage.h"
#include "gonio/devices/stage_gate.h"
#include "gonio/usb_bus/byte_stream.h"

namespace gonio::apt_stage {

class AptLink;

/// A rotation stage that speaks the APT protocol.
///
/// Frame    Joint angle = home angle + (reversed ? -1 : 1) * position / steps_per_deg: the unit
///          counts from its home mark.
/// State    The constructor identifies the unit, enables its motor, sets its speed, and takes it
///          over without homing when it says that it is homed. Unplugged or
///          switched off and on it counts as not homed; home() looks for an unplugged one again by
///          its serial, for at most kReconnect.
/// Homing   The unit searches its mark in one direction, the one it is told. Where it still knows
///          where it is, the axis first goes, within its limits, to the side of the mark from which
///          that leads towards it. Where it does not (switched on anew, stopped during a homing, at
///          a limit switch), an axis on the other side of its mark turns on past the end of its
///          range, until the mark comes round: up to one turn. Before that, turn it by hand to the
///          right side, or see that its cables allow it. One that tells where it stood and knows
///          where it is searches its last degrees at kTellingSpeed.
/// Settled  Completed (told so, or the settled bit), not moving, and within in_position_deg of
///          the target; then AxisSetup::settle on the session's clock. Taken over on its way, or
///          turned at its own panel: not moving, then the same.
/// stop()   Sends the unit's immediate stop: at most one transfer's deadline, whatever the
///          controlling thread waits for. rearm() makes sure that it was obeyed.
/// Time     Timeouts of home() and wait_until_settled() are the session clock's; deadlines of
///          questions the host's.
/// Errors   Beside those of RotationStage: Disconnected (then home() again); Timeout and Protocol
///          of questions, after three attempts; Fault for an alarm bit, a limit switch away from
///          the home mark, and a stop that was ignored; NotHomed when the unit lost its homed bit.
class AptStage final : public devices::RotationStage, public devices::HomingReport {
 public:
  static constexpr std::chrono::milliseconds kReconnect{3000};  ///< host time
  static constexpr double kTellingSpeedDegPerS = 1.0;

  /// `clock` must outlive it. `counts_until_homed`: the user has seen that this unit, told to home,
  /// counts on in its old zero as long as its homing bit is set; no document at hand says so. Then
  /// it tells where it stood before. Throws std::invalid_argument for a set-up the model cannot do,
  /// and DeviceError: Protocol when the unit is another model or does not take its settings.
  AptStage(std::shared_ptr<usb_bus::ByteStream> port, devices::AxisSetup setup, AptModel model,
           bool reversed, devices::Clock& clock,
           HomeDirection home_direction = HomeDirection::falling, bool counts_until_homed = false);
  ~AptStage() override;

  const std::string& name() const override { return gate_.name(); }
  devices::JointLimits limits() const override { return gate_.limits(); }
  void home(std::chrono::milliseconds timeout) override;
  void begin_move_to(Angle target) override;
  Angle wait_until_settled(std::chrono::milliseconds timeout) override;
  void stop() noexcept override;
  void rearm() override;
  bool tells() const override { return counts_until_homed_; }
  std::optional<devices::StoodBeforeHome> stood_before_home() const override {
    return stood_before_home_;
  }

  /// Returns once the axis stands; one that does not is sent the stop again meanwhile. For the end
  /// of a program, after stop(): does not rearm. From the controlling thread. Throws Fault when it
  /// moves on, after its braking time and one second (the session clock's); Timeout, Protocol and
  /// Disconnected when it cannot be asked, and so may move.
  void require_standing();

  /// Who it is: for the session's metadata and `gonio devices`.
  const HardwareInfo& identity() const { return identity_; }

 private:
  using Time = devices::Clock::Duration;

  void identify();
  HomeParams search_at(double deg_per_s) const;
  void set_up();
  void reconnect();
  StatusUpdate confirmed_status();
  StatusUpdate checked_status();
  std::uint32_t alarms_in(const StatusUpdate& status) const;
  void require_no_alarm(const StatusUpdate& status) const;
  void go_before_the_mark(Time deadline);
  void wait_for_home(Time deadline, std::chrono::milliseconds timeout, devices::HomeCount& count);
  void note_where_it_stood(const devices::HomeCount& count);
  StatusUpdate stand_still();
  void wait_until_standing(Time deadline, std::chrono::milliseconds timeout);
  void wait_for_arrival(Time deadline);
  void wait_for_settling(Time deadline, std::chrono::milliseconds timeout);
  void pause() const;
  std::int32_t steps_at(Angle joint) const;
  Angle joint_at(std::int32_t steps) const;
  double distance_deg(const StatusUpdate& status, std::int32_t target) const;
  template <class Act>
  auto losing_home(Act act);

  devices::AxisSetup setup_;
  AptModel model_;
  double direction_;
  HomeDirection home_direction_;
  bool counts_until_homed_;
  devices::Clock& clock_;
  devices::StageGate gate_;
  std::unique_ptr<AptLink> link_;
  HardwareInfo identity_;
  std::optional<std::int32_t> target_;  ///< of the move under way or done, steps
  std::optional<Time> settled_at_;      ///< once it has arrived
  std::optional<devices::StoodBeforeHome> stood_before_home_;
};

/// Runs what talks to the unit; one that has gone is not homed when it comes back.
template <class Act>
auto AptStage::losing_home(Act act) {
  try {
    return act();
  } catch (const devices::DeviceError& error) {
    if (error.code() == devices::DeviceErrc::Disconnected) {
      gate_.set_homed(false);
      target_.reset();
    }
    throw;
  }
}

/// Messages have no checksum: half of one with the next behind it can look like anything. What
/// would end a session is believed when it is said twice.

}  // namespace gonio::apt_stage
