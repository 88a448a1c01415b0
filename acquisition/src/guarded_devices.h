#pragma once

#include <functional>
#include <optional>
#include <stop_token>

#include "gonio/acquisition/session.h"

namespace gonio::acquisition {

/// The devices of a session behind the two rules every path keeps: whatever happens, axes stop and
/// the shutter closes when this object ends; and a device call is repeated only where its error
/// says that this may help.
///
/// Threads  One; a stop request from any thread stops the axes at once.
class GuardedDevices {
 public:
  GuardedDevices(const DeviceSet& devices, const rig::RigDescription& rig,
                 const SessionOptions& options, SessionWriter& archive, std::stop_token stop);
  ~GuardedDevices();
  GuardedDevices(const GuardedDevices&) = delete;
  GuardedDevices& operator=(const GuardedDevices&) = delete;

  void home_all();
  /// Starts all axes, waits for all and returns what the encoders read.
  rig::Joints move_to(const rig::Joints& target);
  void light(const std::string& channel);
  void close_shutter() noexcept;
  void mount(devices::Target target);
  devices::Frame capture(std::chrono::nanoseconds exposure);
  /// 0 without a monitor.
  double read_monitor();
  /// Where the axes stand, as last read back.
  const rig::Joints& joints() const { return joints_; }

  const DeviceSet& devices() const { return devices_; }
  std::chrono::nanoseconds now() const { return devices_.clock->now(); }
  bool stop_requested() const { return stop_.stop_requested(); }

 private:
  /// A camera may round to its own steps; more than this and 1 % is another exposure.
  static constexpr std::chrono::nanoseconds kExposureTolerance = std::chrono::microseconds(20);

  void retrying(const std::function<void()>& call);
  rig::Joints travel(const rig::Joints& target);

  const DeviceSet& devices_;
  const SessionOptions& options_;
  SessionWriter& archive_;
  std::stop_token stop_;
  std::vector<Angle> overshoots_;
  std::optional<std::uint64_t> last_frame_id_;
  rig::Joints joints_;
  std::stop_callback<std::function<void()>> on_stop_;
};

}  // namespace gonio::acquisition
