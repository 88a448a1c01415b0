#include "standing_capture.h"

#include <fmt/format.h>

#include <algorithm>

#include "gonio/devices/clock.h"

namespace gonio::acquisition {
namespace {

/// How far an axis that counts as standing may read from where it arrived: twenty steps of a usual
/// encoder, and well below the 0.05 deg by which the normal of a mounted sample is uncertain.
constexpr Angle kStandingTolerance = Angle::from_degrees(0.02);

/// What the encoders say now.
rig::Joints read_back(const GuardedDevices& devices, const SessionOptions& options,
                      SessionWriter& archive) {
  for (int attempt = 0;; ++attempt) {
    try {
      rig::Joints joints;
      for (devices::RotationStage* stage : devices.devices().stages) {
        joints.push_back(stage->wait_until_settled(options.move_timeout));
      }
      return joints;
    } catch (const devices::DeviceError& error) {
      const bool may_help = error.code() == devices::DeviceErrc::Timeout ||
                            error.code() == devices::DeviceErrc::Protocol;
      if (attempt >= options.retries || !may_help || devices.stop_requested()) throw;
      archive.note(devices.now(), "retry", error.what());
    }
  }
}

}  // namespace

devices::Frame capture_standing(GuardedDevices& devices, const SessionOptions& options,
                                std::chrono::nanoseconds exposure, FrameRecord& record,
                                SessionWriter& archive) {
  const rig::Joints before = read_back(devices, options, archive);
  devices::Frame frame = devices.capture(exposure);
  const rig::Joints after = read_back(devices, options, archive);
  record.joints.clear();
  record.joints_spread.clear();
  for (std::size_t i = 0; i < before.size(); ++i) {
    // Against the arrival, not only over this exposure: a slow creep adds up over a bracket.
    const Angle arrived = devices.joints()[i];
    const Angle astray = std::max(abs(before[i] - arrived), abs(after[i] - arrived));
    if (astray > kStandingTolerance) {
      throw devices::DeviceError(
          devices::DeviceErrc::Timeout, devices.devices().stages[i]->name(),
          fmt::format("stood at {:.4f} deg, went from {:.4f} to {:.4f} deg during an exposure of "
                      "{:g} s, expected it within {:g} deg",
                      arrived.degrees(), before[i].degrees(), after[i].degrees(),
                      devices::to_seconds(exposure), kStandingTolerance.degrees()));
    }
    record.joints.push_back((before[i] + after[i]) / 2.0);
    record.joints_spread.push_back(abs(after[i] - before[i]) / 2.0);
  }
  return frame;
}

}  // namespace gonio::acquisition
