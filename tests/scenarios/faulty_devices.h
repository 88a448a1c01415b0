#pragma once

#include <algorithm>
#include <chrono>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "gonio/acquisition/session.h"
#include "gonio/devices/clock.h"
#include "gonio/devices/device_error.h"
#include "gonio/devices/frame.h"
#include "gonio/devices/watchable_camera.h"

/// Devices that work but for one fault, for tests of whole sessions.
namespace gonio {

/// When a fault strikes: from the beginning of a phase of the session on, a number of times, or for
/// ever. One that is counted is over with its phase.
///
/// Threads  One at a time.
class Strikes {
 public:
  static constexpr int kForEver = -1;

  /// `skip` opportunities pass first. `clock` must outlive it.
  Strikes(std::string phase, int count, int skip, const devices::Clock& clock)
      : phase_(std::move(phase)), left_(count), skip_(skip), clock_(clock) {}

  /// For the session's progress. A point is the second one, so that there is one before it.
  void on_progress(const acquisition::SessionProgress& now) {
    const bool mine = now.phase == phase_ && (now.phase != "point" || now.done == 1);
    if (mine) begun_ = true;
    active_ = mine || (begun_ && left_ == kForEver);
  }

  /// Takes one opportunity.
  bool now() {
    if (!active_ || left_ == 0 || skip_-- > 0) return false;
    if (left_ > 0) --left_;
    if (!first_) first_ = clock_.now();
    return true;
  }

  /// When it struck first.
  std::optional<std::chrono::nanoseconds> first() const { return first_; }

 private:
  std::string phase_;
  int left_;
  int skip_;
  const devices::Clock& clock_;
  bool begun_ = false;
  bool active_ = false;
  std::optional<std::chrono::nanoseconds> first_;
};

/// What a faulty device does instead of one call.
using Misdeed = std::function<void(const std::string& device)>;

/// Throws this error of the device.
inline Misdeed throws(devices::DeviceErrc code, const std::string& message) {
  return [code, message](const std::string& device) {
    throw devices::DeviceError(code, device, message);
  };
}

enum class StageCall { home, move, settle };

/// A stage some of whose calls go wrong. One that was disconnected or lost its home moves again
/// only once it is homed.
class FaultyStage final : public devices::RotationStage {
 public:
  FaultyStage(devices::RotationStage& inner, Strikes& strikes, std::vector<StageCall> calls,
              Misdeed misdeed)
      : inner_(inner), strikes_(strikes), calls_(std::move(calls)), misdeed_(std::move(misdeed)) {}

  /// What the encoder then says too much, instead of an error.
  Angle reads_off;

  const std::string& name() const override { return inner_.name(); }
  devices::JointLimits limits() const override { return inner_.limits(); }
  void home(std::chrono::milliseconds timeout) override {
    strike(StageCall::home);
    inner_.home(timeout);
    knows_home_ = true;
  }
  void begin_move_to(Angle target) override {
    strike(StageCall::move);
    require_home();
    inner_.begin_move_to(target);
  }
  Angle wait_until_settled(std::chrono::milliseconds timeout) override {
    const bool struck = strike(StageCall::settle);
    require_home();
    return inner_.wait_until_settled(timeout) + (struck ? reads_off : Angle());
  }
  void stop() noexcept override { inner_.stop(); }
  void rearm() override { inner_.rearm(); }

 private:
  bool strike(StageCall call) {
    if (std::find(calls_.begin(), calls_.end(), call) == calls_.end() || !strikes_.now()) {
      return false;
    }
    if (!misdeed_) return true;
    try {
      misdeed_(name());
    } catch (const devices::DeviceError& error) {
      if (error.code() == devices::DeviceErrc::Disconnected ||
          error.code() == devices::DeviceErrc::NotHomed) {
        knows_home_ = false;
      }
      throw;
    }
    return true;
  }
  void require_home() const {
    if (knows_home_) return;
    throw devices::DeviceError(devices::DeviceErrc::NotHomed, name(), "was away, home it first");
  }

  devices::RotationStage& inner_;
  Strikes& strikes_;
  std::vector<StageCall> calls_;
  Misdeed misdeed_;
  bool knows_home_ = true;
};

/// A camera that does not answer, or whose frames are spoilt.
class FaultyCamera final : public devices::Camera, public devices::WatchableCamera {
 public:
  using Spoil = std::function<void(devices::Frame&)>;

  FaultyCamera(devices::Camera& inner, Strikes& strikes, Misdeed misdeed, Spoil spoil = {})
      : inner_(inner), strikes_(strikes), misdeed_(std::move(misdeed)), spoil_(std::move(spoil)) {}

  const std::string& name() const override { return inner_.name(); }
  devices::CameraInfo info() const override { return inner_.info(); }
  devices::Frame capture(std::chrono::nanoseconds exposure) override {
    return capture(exposure, [] {});
  }
  devices::Frame capture(std::chrono::nanoseconds exposure,
                         const std::function<void()>& meanwhile) override {
    const bool struck = strikes_.now();
    if (struck && misdeed_) misdeed_(name());
    devices::Frame frame =
        dynamic_cast<devices::WatchableCamera&>(inner_).capture(exposure, meanwhile);
    if (struck && spoil_) spoil_(frame);
    return frame;
  }

 private:
  devices::Camera& inner_;
  Strikes& strikes_;
  Misdeed misdeed_;
  Spoil spoil_;
};

class FaultyLight final : public devices::LightSource {
 public:
  FaultyLight(devices::LightSource& inner, Strikes& strikes, Misdeed misdeed)
      : inner_(inner), strikes_(strikes), misdeed_(std::move(misdeed)) {}

  const std::string& name() const override { return inner_.name(); }
  std::vector<devices::LightChannel> channels() const override { return inner_.channels(); }
  void light(const std::string& channel) override {
    if (strikes_.now()) misdeed_(name());
    inner_.light(channel);
  }
  void close_shutter() noexcept override { inner_.close_shutter(); }

 private:
  devices::LightSource& inner_;
  Strikes& strikes_;
  Misdeed misdeed_;
};

class FaultyMonitor final : public devices::LampMonitor {
 public:
  FaultyMonitor(devices::LampMonitor& inner, Strikes& strikes, Misdeed misdeed)
      : inner_(inner), strikes_(strikes), misdeed_(std::move(misdeed)) {}

  const std::string& name() const override { return inner_.name(); }
  double read() override {
    if (strikes_.now()) misdeed_(name());
    return inner_.read();
  }

 private:
  devices::LampMonitor& inner_;
  Strikes& strikes_;
  Misdeed misdeed_;
};

class FaultyChanger final : public devices::TargetChanger {
 public:
  FaultyChanger(devices::TargetChanger& inner, Strikes& strikes, Misdeed misdeed)
      : inner_(inner), strikes_(strikes), misdeed_(std::move(misdeed)) {}

  const std::string& name() const override { return inner_.name(); }
  devices::Target mounted() const override { return inner_.mounted(); }
  void mount(devices::Target target) override {
    if (strikes_.now()) misdeed_(name());
    inner_.mount(target);
  }

 private:
  devices::TargetChanger& inner_;
  Strikes& strikes_;
  Misdeed misdeed_;
};

}  // namespace gonio
