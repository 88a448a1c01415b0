#include "gonio/acquisition/guarded_devices.h"

#include <fmt/format.h>

#include <algorithm>
#include <exception>
#include <future>
#include <thread>
#include <utility>
#include <vector>

#include "gonio/devices/watchable_camera.h"
#include "gonio/rig/paths.h"

namespace gonio::acquisition {
namespace {

/// A camera may round an exposure to its own steps; more than this and 1 % is another exposure.
constexpr std::chrono::nanoseconds kExposureTolerance = std::chrono::microseconds(20);

/// Makes a move a falling one, which takes up the play, and goes no way of its own.
constexpr Angle kAbove = Angle::from_radians(1e-9);

/// All at the same time: one that does not answer must not keep the others moving.
void make_safe(const DeviceSet& devices) noexcept {
  std::vector<std::thread> threads;
  const auto at_once = [&](const auto& act) {
    try {
      threads.emplace_back(act);
    } catch (const std::exception&) {
      act();
    }
  };
  for (devices::RotationStage* stage : devices.stages) {
    at_once([stage] { stage->stop(); });
  }
  if (devices.light != nullptr) at_once([&devices] { devices.light->close_shutter(); });
  for (std::thread& thread : threads) thread.join();
}

bool may_help_to_retry(devices::DeviceErrc code) {
  return code == devices::DeviceErrc::Timeout || code == devices::DeviceErrc::Protocol;
}

/// Between two attempts to find a device that dropped off.
constexpr std::chrono::nanoseconds kBetweenAttempts = std::chrono::seconds(5);

}  // namespace

bool dropped_off(devices::DeviceErrc code) {
  return code == devices::DeviceErrc::Disconnected || code == devices::DeviceErrc::NotHomed;
}

GuardedDevices::GuardedDevices(const DeviceSet& devices, const rig::RigDescription& rig,
                               const SessionOptions& options, Note note, std::stop_token stop)
    : devices_(devices),
      rig_(rig),
      travel_model_(rig),
      options_(options),
      note_(std::move(note)),
      stop_(stop),
      homings_(devices.stages.size()),
      on_stop_(stop, [this] { make_safe(devices_); }) {
  close_shutter();
}

GuardedDevices::~GuardedDevices() { make_safe(devices_); }

void GuardedDevices::require_running() const {
  if (!stop_requested()) return;
  // The request may have come between a check and a call that arms or opens something.
  make_safe(devices_);
  throw devices::DeviceError(devices::DeviceErrc::Stopped, "session", "asked to stop");
}

void GuardedDevices::retrying(const std::function<void()>& call, Again again) {
  for (int attempt = 0;; ++attempt) {
    require_running();
    try {
      call();
      return require_running();
    } catch (const devices::DeviceError& error) {
      const bool helps =
          may_help_to_retry(error.code()) &&
          (again == Again::after_all || error.code() != devices::DeviceErrc::Timeout);
      if (attempt >= options_.retries || !helps || stop_requested()) throw;
      note_(now(), "retry", error.what());
    }
  }
}

void GuardedDevices::home_all() {
  for (devices::RotationStage* stage : devices_.stages) {
    retrying([&] { stage->rearm(); });
  }
  for (std::size_t axis = 0; axis < devices_.stages.size(); ++axis) find_home(axis);
  joints_ = read_joints();
  sent_ = rig_.home();
  approached_.assign(rig_.axes.size(), false);
}

void GuardedDevices::find_home(std::size_t axis) {
  devices::RotationStage& stage = *devices_.stages.at(axis);
  // A Timeout may be a lost answer or a mark that did not come. Driving against the same obstacle
  // again does harm; ending a session that has only begun does none.
  retrying(
      [&] {
        try {
          stage.home(options_.move_timeout);
        } catch (const devices::DeviceError&) {
          see_homing(axis, false);
          throw;
        }
        see_homing(axis, true);
      },
      Again::not_after_timeout);
}

void GuardedDevices::see_homing(std::size_t axis, bool homed) {
  HomingEvidence& evidence = homings_[axis];
  evidence.homed = evidence.homed || homed;
  const auto* const report = dynamic_cast<const devices::HomingReport*>(devices_.stages[axis]);
  if (evidence.stood || report == nullptr || !report->tells()) return;
  evidence.stood = report->stood_before_home();
  evidence.hidden = evidence.hidden || !evidence.stood;
}

void GuardedDevices::home(std::size_t axis) {
  find_home(axis);
  joints_ = read_joints();
  sent_[axis] = rig_.axes[axis].home;
  approached_[axis] = false;
}

void GuardedDevices::take_over() {
  for (devices::RotationStage* stage : devices_.stages) {
    retrying([&] { stage->rearm(); });
  }
  joints_ = read_joints();
  sent_ = joints_;
  approached_.assign(rig_.axes.size(), false);
}

rig::Joints GuardedDevices::read_joints() {
  rig::Joints joints;
  retrying([&] {
    joints.clear();
    for (devices::RotationStage* stage : devices_.stages) {
      joints.push_back(stage->wait_until_settled(options_.move_timeout));
    }
  });
  last_reading_ = joints;
  return joints;
}

rig::Joints GuardedDevices::start_of_move(const rig::Joints& target) {
  rig::Joints from = read_joints();
  for (std::size_t i = 0; i < from.size(); ++i) {
    const rig::Axis& axis = rig_.axes[i];
    // Within the margin of the plan the axis stands where it was sent: taken from the reading, the
    // last thousandth of a degree would make falling moves, with an overshoot, of no moves at all.
    from[i] = abs(from[i] - sent_[i]) <= rig::kPlanningMargin
                  ? sent_[i]
                  : std::clamp(from[i], axis.min, axis.max);
    // Somewhere in its play, and too near below for a rising move to take that up: as from above.
    if (!approached_[i] && from[i] <= target[i] && target[i] - from[i] < axis.approach_overshoot) {
      from[i] = target[i] + kAbove;
    }
  }
  return from;
}

rig::Joints GuardedDevices::move_to(const rig::Joints& target) {
  try {
    rig::Joints at = start_of_move(target);
    auto route = travel_model_.route(at, target);
    // An error may have left the axes nearer to a keep-out than plans go.
    if (!route) route = travel_model_.route(at, target, Angle());
    if (!route) {
      throw devices::DeviceError(devices::DeviceErrc::LimitViolation, "rig",
                                 "keep-outs bar the way to the next pose");
    }
    for (const rig::Joints& stop : route->via) {
      travel(at, stop);
      at = stop;
    }
    travel(at, target);
  } catch (const devices::DeviceError&) {
    if (!stop_requested()) stand_still();
    throw;
  } catch (...) {
    make_safe(devices_);
    throw;
  }
  return joints_;
}

void GuardedDevices::read_back(std::size_t axis) {
  joints_[axis] = devices_.stages[axis]->wait_until_settled(options_.move_timeout);
}

/// Every axis is waited for by a thread of its own: one after the other, the settling of the later
/// ones would begin only when the earlier ones have settled. An error that a repetition does not
/// mend stops all at once; otherwise all are waited for.
void GuardedDevices::read_back_together() {
  std::vector<std::future<void>> waits;
  for (std::size_t i = 0; i < devices_.stages.size(); ++i) {
    waits.push_back(std::async(std::launch::async, [this, i] {
      try {
        read_back(i);
      } catch (const devices::DeviceError& error) {
        if (!may_help_to_retry(error.code())) make_safe(devices_);
        throw;
      } catch (...) {
        make_safe(devices_);
        throw;
      }
    }));
  }
  // The first that is not the echo of a stop on account of another.
  std::exception_ptr first;
  std::exception_ptr stopped;
  for (std::future<void>& wait : waits) {
    try {
      wait.get();
    } catch (const devices::DeviceError& error) {
      std::exception_ptr& slot = error.code() == devices::DeviceErrc::Stopped ? stopped : first;
      if (!slot) slot = std::current_exception();
    } catch (...) {
      if (!first) first = std::current_exception();
    }
  }
  if (first) std::rethrow_exception(first);
  if (stopped) std::rethrow_exception(stopped);
}

void GuardedDevices::travel(const rig::Joints& from, const rig::Joints& target) {
  // One-sided approach: an axis that comes from above first goes past its target.
  rig::Joints below = target;
  for (std::size_t i = 0; i < target.size(); ++i) {
    below[i] = target[i] - rig::overshoot(rig_.axes[i], from[i], target[i]);
  }
  if (rig_.simultaneous_axes) {
    const auto go = [&](const rig::Joints& to) {
      retrying([&] {
        for (std::size_t i = 0; i < to.size(); ++i) devices_.stages[i]->begin_move_to(to[i]);
        read_back_together();
      });
    };
    if (below != target) go(below);
    go(target);
  } else {
    // One axis at a time ends its approach before the next begins: the boxes that
    // rig::keep_out_between() looks at.
    const auto go = [&](std::size_t i, Angle to) {
      retrying([&] {
        devices_.stages[i]->begin_move_to(to);
        read_back(i);
      });
    };
    for (std::size_t i = 0; i < target.size(); ++i) {
      if (below[i] != target[i]) go(i, below[i]);
      go(i, target[i]);
    }
  }
  sent_ = target;
  approached_.assign(target.size(), true);
  last_reading_ = joints_;
  for (std::size_t i = 0; i < target.size(); ++i) {
    if (abs(joints_[i] - target[i]) <= rig::kPlanningMargin) continue;
    throw devices::DeviceError(
        devices::DeviceErrc::Timeout, devices_.stages[i]->name(),
        fmt::format("was sent to {:.4f} deg and stands at {:.4f} deg, expected within {:g} deg",
                    target[i].degrees(), joints_[i].degrees(), rig::kPlanningMargin.degrees()));
  }
}

void GuardedDevices::stand_still() {
  make_safe(devices_);
  try {
    retrying([&] {
      for (devices::RotationStage* stage : devices_.stages) stage->rearm();
    });
    joints_ = read_joints();
    sent_ = joints_;
    approached_.assign(rig_.axes.size(), false);
  } catch (const devices::DeviceError& error) {
    // Where the axes stand is not known, so no way from here can be checked.
    if (dropped_off(error.code())) read_what_answers();
    make_safe(devices_);
    if (dropped_off(error.code())) throw;
    throw devices::DeviceError(
        devices::DeviceErrc::Fault, error.device(),
        fmt::format("does not stand still after an error: {}", error.what()));
  }
}

void GuardedDevices::read_what_answers() {
  for (std::size_t i = 0; i < devices_.stages.size(); ++i) {
    try {
      devices_.stages[i]->rearm();
      last_reading_[i] = devices_.stages[i]->wait_until_settled(options_.move_timeout);
    } catch (const devices::DeviceError&) {
      // Of this one it stays what it was before the move.
    }
  }
}

void GuardedDevices::come_back(const std::function<void()>& once_safe) {
  make_safe(devices_);
  once_safe();
  const auto give_up = now() + kMayBeAway;
  while (true) {
    // In steps, so that a request to stop is heard.
    for (const auto until = now() + kBetweenAttempts; now() < until;) {
      require_running();
      devices_.clock->wait_until(std::min(until, now() + std::chrono::seconds(1)));
    }
    try {
      return home_all();
    } catch (const devices::DeviceError& error) {
      make_safe(devices_);
      if (!dropped_off(error.code()) || now() >= give_up) throw;
    }
  }
}

void GuardedDevices::light(const std::string& channel) {
  retrying([&] { devices_.light->light(channel); });
}

void GuardedDevices::close_shutter() noexcept {
  if (devices_.light != nullptr) devices_.light->close_shutter();
}

void GuardedDevices::mount(devices::Target target) {
  if (devices_.changer == nullptr || devices_.changer->mounted() == target) return;
  close_shutter();
  retrying([&] { devices_.changer->mount(target); });
}

void GuardedDevices::check_frame(const devices::Frame& frame,
                                 std::chrono::nanoseconds exposure) const {
  const auto refuse = [&](const std::string& why) {
    throw devices::DeviceError(devices::DeviceErrc::Protocol, devices_.camera->name(), why);
  };
  const devices::CameraInfo info = devices_.camera->info();
  const auto pixels =
      static_cast<std::size_t>(info.width_px) * static_cast<std::size_t>(info.height_px);
  if (frame.width_px != info.width_px || frame.height_px != info.height_px ||
      frame.pixel_format != info.pixel_format || frame.pixels_dn.size() != pixels) {
    refuse(fmt::format("frame {} has another size or format than {} x {} {}", frame.frame_id,
                       info.width_px, info.height_px, devices::to_string(info.pixel_format)));
  }
  const auto difference = std::chrono::abs(frame.exposure - exposure);
  if (difference > kExposureTolerance && difference * 100 > exposure) {
    refuse(fmt::format("asked to expose {} ns, the frame says {} ns", exposure.count(),
                       frame.exposure.count()));
  }
  if (!last_frame_) return;
  if (frame.frame_id == last_frame_->frame_id) {
    refuse(fmt::format("frame id {} came twice", frame.frame_id));
  }
  if (frame.gain_db != last_frame_->gain_db ||
      frame.black_level_dn != last_frame_->black_level_dn ||
      frame.saturation_level_dn != last_frame_->saturation_level_dn) {
    refuse(fmt::format(
        "frame {} has gain {:g} dB, black level {:g} DN and is full at {} DN, those "
        "before {:g} dB, {:g} DN and {} DN",
        frame.frame_id, frame.gain_db, frame.black_level_dn, frame.saturation_level_dn,
        last_frame_->gain_db, last_frame_->black_level_dn, last_frame_->saturation_level_dn));
  }
}

devices::Frame GuardedDevices::capture(std::chrono::nanoseconds exposure,
                                       const std::function<void()>& meanwhile) {
  devices::Frame frame;
  auto* const watchable =
      meanwhile ? dynamic_cast<devices::WatchableCamera*>(devices_.camera) : nullptr;
  retrying([&] {
    frame = watchable != nullptr ? watchable->capture(exposure, meanwhile)
                                 : devices_.camera->capture(exposure);
    check_frame(frame, exposure);
  });
  last_frame_ = {frame.frame_id, frame.gain_db, frame.black_level_dn, frame.saturation_level_dn};
  return frame;
}

double GuardedDevices::read_monitor() {
  double reading = 0.0;
  if (devices_.monitor != nullptr) retrying([&] { reading = devices_.monitor->read(); });
  return reading;
}

}  // namespace gonio::acquisition
