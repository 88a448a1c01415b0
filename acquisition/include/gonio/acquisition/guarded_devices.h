#pragma once

#include <functional>
#include <optional>
#include <stop_token>
#include <vector>

#include "gonio/acquisition/session.h"
#include "gonio/devices/device_error.h"
#include "gonio/devices/homing_report.h"

namespace gonio::acquisition {

/// How long a device that dropped off is waited for, session clock.
inline constexpr std::chrono::nanoseconds kMayBeAway = std::chrono::minutes(1);

/// Whether a device is gone, or was and knows no longer where it stands.
bool dropped_off(devices::DeviceErrc code);

/// What the homings of one axis have told since they were judged last. The first that tells counts:
/// a homing sets the zero anew, and what it has put right no later one sees.
struct HomingEvidence {
  bool homed = false;                             ///< once at least
  std::optional<devices::StoodBeforeHome> stood;  ///< of the first that told
  /// One before that told nothing, and may have set the zero anew.
  bool hidden = false;
};

/// The devices of a rig behind the rules every path keeps, in a session and by hand: whatever
/// happens, axes stop and the shutter closes when this object ends; after a stop request nothing
/// moves, opens or is taken any more; a device call is repeated only where its error says that this
/// may help.
///
/// State    Nothing moves before home_all() or take_over().
/// Threads  One; a stop request from any thread stops the axes at once.
/// Errors   devices::DeviceError; Stopped from every call once a stop has been requested.
class GuardedDevices {
 public:
  /// Told what was repeated and why: the time, "retry", the error.
  using Note =
      std::function<void(std::chrono::nanoseconds, const std::string&, const std::string&)>;

  /// All that is passed by reference must outlive it. What a caller does not use may be missing
  /// from `devices`, but for the stages and the clock.
  GuardedDevices(const DeviceSet& devices, const rig::RigDescription& rig,
                 const SessionOptions& options, Note note, std::stop_token stop);
  ~GuardedDevices();
  GuardedDevices(const GuardedDevices&) = delete;
  GuardedDevices& operator=(const GuardedDevices&) = delete;

  void home_all();
  /// One axis alone, the others standing where they are. Throws std::out_of_range.
  void home(std::size_t axis);
  /// Of an axis that has the ability (devices::HomingReport), repeated and failed homings included.
  const HomingEvidence& homing_evidence(std::size_t axis) const { return homings_.at(axis); }
  /// It has been judged, or there is nothing to judge it by.
  void forget_homing(std::size_t axis) { homings_.at(axis) = {}; }
  /// Starts from axes that know where they are, instead of homing. Throws NotHomed.
  void take_over();
  /// Goes there from where the encoders say the axes are, around keep-outs, each axis approached
  /// from its one side, and returns what the encoders read. After an error the axes stand, armed,
  /// where joints() says, and another move may be tried; when that cannot be had, the error is a
  /// Fault. Throws LimitViolation, without moving, when keep-outs bar every known way;
  /// Timeout when an axis stands more than rig::kPlanningMargin from where it was sent.
  rig::Joints move_to(const rig::Joints& target);
  /// Stops all axes where they are, arms them again and reads them back. Throws Fault when one does
  /// not stand, or what says that one dropped_off(); then nothing may move any more.
  void stand_still();
  /// After an error that says dropped_off(): stops all, closes the shutter, calls `once_safe`, and
  /// homes all axes anew as soon as they are back, which opens their connections and asks who they
  /// are. Cameras, lamps and monitors do that at their next call. Throws the last error once
  /// kMayBeAway has passed.
  void come_back(const std::function<void()>& once_safe);
  /// What the encoders read now, once all axes stand. Does not change joints().
  rig::Joints read_joints();
  /// What they read last: by read_joints(), on arrival, or where they stopped after an error.
  /// Nothing was sent to move since, but for an axis that dropped off: that may be on its way.
  const rig::Joints& last_reading() const { return last_reading_; }
  void light(const std::string& channel);
  void close_shutter() noexcept;
  void mount(devices::Target target);
  /// The frame of exactly this exposure; a frame of another size, format, exposure time, gain or
  /// level than the first, or one that came before, is an error.
  /// `meanwhile` is called while it is exposed, where the camera is a devices::WatchableCamera.
  devices::Frame capture(std::chrono::nanoseconds exposure,
                         const std::function<void()>& meanwhile = {});
  /// 0 without a monitor.
  double read_monitor();
  /// Where the axes arrived, as read back then.
  const rig::Joints& joints() const { return joints_; }

  const DeviceSet& devices() const { return devices_; }
  std::chrono::nanoseconds now() const { return devices_.clock->now(); }
  bool stop_requested() const { return stop_.stop_requested(); }

 private:
  void require_running() const;
  /// Which of the errors that a repetition may help are reason for one.
  enum class Again { after_all, not_after_timeout };
  void retrying(const std::function<void()>& call, Again again = Again::after_all);
  void find_home(std::size_t axis);
  void see_homing(std::size_t axis, bool homed);
  rig::Joints start_of_move(const rig::Joints& target);
  void travel(const rig::Joints& from, const rig::Joints& target);
  void read_back(std::size_t axis);
  /// A slip of the axes that stay is judged by where they stopped, when another drops off.
  void read_what_answers();
  void read_back_together();

  const DeviceSet& devices_;
  const rig::RigDescription& rig_;
  rig::TravelModel travel_model_;
  const SessionOptions& options_;
  Note note_;
  std::stop_token stop_;
  /// Of the frame taken last. A camera keeps its gain and levels for its life.
  struct FrameFacts {
    std::uint64_t frame_id = 0;
    double gain_db = 0.0;
    double black_level_dn = 0.0;
    std::uint16_t saturation_level_dn = 0;
  };
  void check_frame(const devices::Frame& frame, std::chrono::nanoseconds exposure) const;

  std::optional<FrameFacts> last_frame_;
  rig::Joints joints_;
  rig::Joints last_reading_;
  rig::Joints sent_;  ///< where the axes were sent last; after an error, where they stood
  std::vector<HomingEvidence> homings_;  ///< by axis
  /// Of each axis: it came to where it stands from its one side. Not known after homing, say.
  std::vector<bool> approached_;
  std::stop_callback<std::function<void()>> on_stop_;
};

}  // namespace gonio::acquisition
