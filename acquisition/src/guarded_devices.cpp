#include "guarded_devices.h"

#include <fmt/format.h>

#include <algorithm>

namespace gonio::acquisition {
namespace {

void make_safe(const DeviceSet& devices) noexcept {
  for (devices::RotationStage* stage : devices.stages) stage->stop();
  devices.light->close_shutter();
}

bool may_help_to_retry(devices::DeviceErrc code) {
  return code == devices::DeviceErrc::Timeout || code == devices::DeviceErrc::Protocol;
}

}  // namespace

GuardedDevices::GuardedDevices(const DeviceSet& devices, const rig::RigDescription& rig,
                               const SessionOptions& options, SessionWriter& archive,
                               std::stop_token stop)
    : devices_(devices), options_(options), archive_(archive), stop_(stop), on_stop_(stop, [this] {
        make_safe(devices_);
      }) {
  for (const rig::Axis& axis : rig.axes) overshoots_.push_back(axis.approach_overshoot);
  devices_.light->close_shutter();
}

GuardedDevices::~GuardedDevices() { make_safe(devices_); }

void GuardedDevices::retrying(const std::function<void()>& call) {
  for (int attempt = 0;; ++attempt) {
    try {
      return call();
    } catch (const devices::DeviceError& error) {
      if (attempt >= options_.retries || !may_help_to_retry(error.code()) || stop_requested()) {
        throw;
      }
      archive_.note(now(), "retry", error.what());
    }
  }
}

void GuardedDevices::home_all() {
  for (devices::RotationStage* stage : devices_.stages) stage->rearm();
  joints_.clear();
  for (devices::RotationStage* stage : devices_.stages) {
    retrying([&] { stage->home(options_.move_timeout); });
    joints_.push_back(stage->wait_until_settled(options_.move_timeout));
  }
}

rig::Joints GuardedDevices::move_to(const rig::Joints& target) {
  // One-sided approach: an axis whose target lies below first goes past it, all axes together.
  rig::Joints via = target;
  bool overshoots = false;
  for (std::size_t i = 0; i < target.size(); ++i) {
    const Angle overshoot = overshoots_.at(i);
    if (overshoot > Angle() && target[i] < joints_[i]) {
      via[i] = std::max(target[i] - overshoot, devices_.stages[i]->limits().min);
      overshoots = true;
    }
  }
  if (overshoots) travel(via);
  return travel(target);
}

rig::Joints GuardedDevices::travel(const rig::Joints& target) {
  retrying([&] {
    for (std::size_t i = 0; i < target.size(); ++i) devices_.stages[i]->begin_move_to(target[i]);
    for (std::size_t i = 0; i < target.size(); ++i) {
      joints_[i] = devices_.stages[i]->wait_until_settled(options_.move_timeout);
    }
  });
  return joints_;
}

void GuardedDevices::light(const std::string& channel) {
  retrying([&] { devices_.light->light(channel); });
}

void GuardedDevices::close_shutter() noexcept { devices_.light->close_shutter(); }

void GuardedDevices::mount(devices::Target target) {
  if (devices_.changer == nullptr || devices_.changer->mounted() == target) return;
  close_shutter();
  retrying([&] { devices_.changer->mount(target); });
}

devices::Frame GuardedDevices::capture(std::chrono::nanoseconds exposure) {
  devices::Frame frame;
  retrying([&] {
    frame = devices_.camera->capture(exposure);
    const devices::CameraInfo info = devices_.camera->info();
    const auto expected =
        static_cast<std::size_t>(info.width_px) * static_cast<std::size_t>(info.height_px);
    if (frame.width_px != info.width_px || frame.height_px != info.height_px ||
        frame.pixel_format != info.pixel_format || frame.pixels_dn.size() != expected) {
      throw devices::DeviceError(
          devices::DeviceErrc::Protocol, devices_.camera->name(),
          fmt::format("frame {} has another size or format than {} x {} {}", frame.frame_id,
                      info.width_px, info.height_px, devices::to_string(info.pixel_format)));
    }
    const auto difference = std::chrono::abs(frame.exposure - exposure);
    if (difference > kExposureTolerance && difference * 100 > exposure) {
      throw devices::DeviceError(devices::DeviceErrc::Protocol, devices_.camera->name(),
                                 fmt::format("asked to expose {} ns, the frame says {} ns",
                                             exposure.count(), frame.exposure.count()));
    }
    if (last_frame_id_ && frame.frame_id == *last_frame_id_) {
      throw devices::DeviceError(devices::DeviceErrc::Protocol, devices_.camera->name(),
                                 fmt::format("frame id {} came twice", frame.frame_id));
    }
  });
  last_frame_id_ = frame.frame_id;
  return frame;
}

double GuardedDevices::read_monitor() {
  double reading = 0.0;
  if (devices_.monitor != nullptr) retrying([&] { reading = devices_.monitor->read(); });
  return reading;
}

}  // namespace gonio::acquisition
