#include "gonio/aravis_camera/aravis_camera.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <thread>
#include <type_traits>
#include <utility>

#include "frame_reader.h"
#include "settings_check.h"
#include "text.h"

namespace gonio::aravis_camera {

using devices::DeviceErrc;
using devices::DeviceError;

namespace {

constexpr std::chrono::milliseconds kBetweenAttempts{200};
// A live picture may lose frames, but not all of them.
constexpr int kBadInARow = 20;
// Of the host's time: what its clock and an emulated camera's may differ by.
constexpr std::chrono::milliseconds kArrivalTolerance{1};

std::chrono::nanoseconds host_now() { return std::chrono::steady_clock::now().time_since_epoch(); }

std::int64_t to_ms(std::chrono::nanoseconds time) { return time.count() / 1000000; }

std::chrono::nanoseconds from_us(double us) {
  return std::chrono::nanoseconds(std::llround(us * 1000.0));
}

}  // namespace

/// The state machine: connected or not, and the acquisition in order or to be started anew.
class AravisCamera::Machine {
 public:
  Machine(const AravisCameraOptions& options, const devices::SteadyClock& clock, LinkOpener opener,
          std::stop_token stop)
      : options_(checked(options)),
        reader_(options_, identity_, counters_),
        clock_(clock),
        opener_(std::move(opener)),
        stop_(std::move(stop)) {
    connect();
  }

  const std::string& name() const { return options_.name; }
  const CameraIdentity& identity() const { return identity_; }
  CameraCounters counters() const { return counters_; }

  devices::CameraInfo info() const {
    devices::CameraInfo info;
    info.model = identity_.model;
    info.serial = identity_.serial;
    info.width_px = identity_.region.width;
    info.height_px = identity_.region.height;
    info.pixel_format = reader_.format().layout;
    info.saturation_level_dn = reader_.saturation_level();
    info.min_exposure = std::chrono::nanoseconds(std::llround(std::ceil(min_ns())));
    info.max_exposure = std::chrono::nanoseconds(std::llround(std::floor(max_ns())));
    info.readout = options_.readout;
    return info;
  }

  devices::Frame capture(std::chrono::nanoseconds exposure,
                         const std::function<void()>& meanwhile) {
    require_in_range(exposure);
    return with_link([&] {
      for (int attempt = 0;; ++attempt) {
        try {
          return expose(exposure, meanwhile);
        } catch (const DeviceError& error) {
          restart_first_ = true;
          const bool may_help =
              error.code() == DeviceErrc::Timeout || error.code() == DeviceErrc::Protocol;
          if (!may_help || attempt >= options_.retries) throw;
          ++counters_.retried;
        }
      }
    });
  }

  void stream(std::chrono::nanoseconds exposure,
              const std::function<bool(const devices::Frame&)>& take) {
    require_in_range(exposure);
    with_link([&] {
      restart_first_ = true;  // back to triggers, however this ends
      exposure_set_ = std::max(exposure_set_, exposure);
      link_->set_exposure_us(static_cast<double>(exposure.count()) / 1000.0);
      link_->restart(true);
      reader_.restart();
      const CameraState state = verified(exposure, true);
      devices::Frame frame;  // its memory serves all
      int bad_in_a_row = 0;
      for (bool more = true; more;) {
        const auto patience = patience_for(exposure);
        const bool came = link_->take_frame(patience, [&](const RawFrame& raw) {
          const std::string problem = reader_.problem_of(raw);  // counts it
          bad_in_a_row = problem.empty() ? 0 : bad_in_a_row + 1;
          if (bad_in_a_row > kBadInARow) throw DeviceError(DeviceErrc::Protocol, name(), problem);
          if (bad_in_a_row > 0) return;
          reader_.fill(frame, raw, state);
          frame.exposure_start = session_time(raw.arrived) - frame.exposure - options_.readout;
          more = take(frame);
        });
        if (!came) fail_without_frame(patience);
      }
      verified(exposure, true);
    });
  }

  double temperature_c() {
    return with_link([&] {
      const std::optional<double> found = link_->temperature_c();
      if (!found) {
        throw DeviceError(DeviceErrc::Fault, name(), "this camera has no DeviceTemperature");
      }
      return *found;
    });
  }

 private:
  static const AravisCameraOptions& checked(const AravisCameraOptions& options) {
    options.validate();
    return options;
  }

  double min_ns() const { return identity_.min_exposure_us * 1000.0; }
  double max_ns() const { return identity_.max_exposure_us * 1000.0; }

  void require_in_range(std::chrono::nanoseconds exposure) const {
    const auto ns = static_cast<double>(exposure.count());
    if (ns >= min_ns() && ns <= max_ns()) return;
    throw DeviceError(DeviceErrc::LimitViolation, name(),
                      joined("exposure ", ns / 1000.0, " us, limits ", identity_.min_exposure_us,
                             " .. ", identity_.max_exposure_us, " us"));
  }

  /// Runs `action` on a link that works, as far as anybody knows.
  template <typename Action>
  std::invoke_result_t<const Action&> with_link(const Action& action) {
    if (lost_) {
      connect();
      ++counters_.reconnects;
    }
    try {
      return action();
    } catch (const DeviceError& error) {
      // The link is let go of by the next call: that may take seconds, and the error is due now.
      if (error.code() == DeviceErrc::Disconnected) lost_ = true;
      throw;
    }
  }

  void connect() {
    const auto give_up = std::chrono::steady_clock::now() + options_.open_patience;
    link_.reset();
    lost_ = true;
    while (true) {
      if (stop_.stop_requested()) {
        throw DeviceError(DeviceErrc::Stopped, name(), "asked to stop while it was connected to");
      }
      try {
        link_ = opener_();
        break;
      } catch (const DeviceError& error) {
        const bool may_come_back =
            error.code() == DeviceErrc::Disconnected || error.code() == DeviceErrc::Timeout;
        if (!may_come_back || std::chrono::steady_clock::now() >= give_up) throw;
      }
      std::this_thread::sleep_for(kBetweenAttempts);
    }
    require_same_camera(link_->identity());
    identity_ = link_->identity();
    const CameraState state = link_->state();
    require_settings(state, std::nullopt, false);
    exposure_set_ = from_us(state.exposure_us);
    reader_.restart();
    restart_first_ = false;
    lost_ = false;
  }

  void require_same_camera(const CameraIdentity& found) const {
    const std::string& serial = identity_.serial.empty() ? options_.serial : identity_.serial;
    if (!serial.empty() && found.serial != serial) {
      throw DeviceError(DeviceErrc::Protocol, name(),
                        joined("another camera answers at ", options_.device, ": serial ",
                               found.serial, ", expected ", serial));
    }
  }

  devices::Frame expose(std::chrono::nanoseconds exposure, const std::function<void()>& meanwhile) {
    // A line is pulsed whether or not anybody asks: only a new acquisition has none of the
    // exposures that were under way.
    if (restart_first_ || by_line()) {
      link_->restart(false);
      reader_.restart();
      restart_first_ = false;
    }
    arm(exposure);
    return by_line() ? await_pulse(exposure, meanwhile) : expose_by_software(exposure, meanwhile);
  }

  bool by_line() const { return !options_.trigger_line.empty(); }

  /// Sets the exposure; what came before is thrown away.
  void arm(std::chrono::nanoseconds exposure) {
    const std::chrono::nanoseconds longest = std::max(exposure_set_, exposure);
    exposure_set_ = longest;  // until it is known that the camera took the new one
    link_->set_exposure_us(static_cast<double>(exposure.count()) / 1000.0);
    // There are cameras that finish after a restart what they were exposing. Of the old length, it
    // would come when an exposure of a shorter one is due.
    const bool wait_it_out = by_line() && longest > exposure;
    const auto until =
        host_now() + (wait_it_out ? clock_.on_host(longest + options_.readout) + kArrivalTolerance
                                  : std::chrono::nanoseconds(0));
    const auto discard = [&](const RawFrame& raw) { reader_.pass_over(raw); };
    while (link_->take_frame(until - host_now(), discard)) {
    }
    exposure_set_ = exposure;
  }

  /// Host's time that a frame takes at least, from its trigger on.
  std::chrono::nanoseconds shortest(std::chrono::nanoseconds exposure,
                                    std::chrono::nanoseconds readout) const {
    const auto granted = std::chrono::nanoseconds(
        std::llround(static_cast<double>(exposure.count()) * (1.0 - kExposureTolerance)));
    return clock_.on_host(granted + readout) - kArrivalTolerance;
  }

  devices::Frame expose_by_software(std::chrono::nanoseconds exposure,
                                    const std::function<void()>& meanwhile) {
    // Nobody else triggers, so that a frame too early is a fault. How quickly the camera reads out
    // need not be known for that.
    const std::chrono::nanoseconds start = clock_.now();
    const auto earliest = host_now() + shortest(exposure, std::chrono::nanoseconds(0));
    link_->trigger();
    const auto patience = patience_for(exposure);
    const auto give_up = host_now() + patience;
    meanwhile();
    const auto left = std::max(give_up - host_now(), std::chrono::nanoseconds(0));
    std::optional<devices::Frame> frame;
    const bool came = link_->take_frame(left, [&](const RawFrame& raw) {
      frame = good_frame(raw, exposure);
      if (raw.arrived < earliest) {
        ++counters_.unexpected;
        throw DeviceError(DeviceErrc::Protocol, name(),
                          joined("frame ", raw.id, " came ", to_ms(earliest - raw.arrived),
                                 " ms before its exposure could end; does something else trigger "
                                 "the camera?"));
      }
    });
    if (!came) fail_without_frame(patience);
    frame->exposure_start = start;
    return counted(std::move(*frame));
  }

  devices::Frame await_pulse(std::chrono::nanoseconds exposure,
                             const std::function<void()>& meanwhile) {
    const auto armed = host_now();
    const auto earliest = armed + shortest(exposure, options_.readout);
    const auto patience = patience_for(exposure);
    int too_early = 0;
    meanwhile();
    while (true) {
      std::optional<devices::Frame> frame;
      const auto left = std::max(armed + patience - host_now(), std::chrono::nanoseconds(0));
      const bool came = link_->take_frame(left, [&](const RawFrame& raw) {
        if (raw.arrived < earliest) {
          ++too_early;
          return reader_.pass_over(raw);
        }
        frame = good_frame(raw, exposure);
        frame->exposure_start = session_time(raw.arrived) - frame->exposure - options_.readout;
      });
      if (frame) return counted(std::move(*frame));
      if (!came) fail_without_frame(patience, too_early);
    }
  }

  devices::Frame good_frame(const RawFrame& raw, std::chrono::nanoseconds exposure) {
    const std::string problem = reader_.problem_of(raw);
    if (!problem.empty()) throw DeviceError(DeviceErrc::Protocol, name(), problem);
    devices::Frame frame;
    reader_.fill(frame, raw, verified(exposure, false));
    return frame;
  }

  devices::Frame counted(devices::Frame frame) {
    frame.frame_id = next_frame_++;
    ++counters_.frames;
    return frame;
  }

  /// The session's time of a moment of the host's.
  std::chrono::nanoseconds session_time(std::chrono::nanoseconds host) const {
    const std::chrono::duration<double, std::nano> ago = host_now() - host;
    return clock_.now() - std::chrono::nanoseconds(std::llround(ago.count() * clock_.time_scale()));
  }

  std::chrono::nanoseconds patience_for(std::chrono::nanoseconds exposure) const {
    return clock_.on_host(exposure + options_.readout) + options_.frame_margin;
  }

  [[noreturn]] void fail_without_frame(std::chrono::nanoseconds patience, int too_early = 0) {
    ++counters_.timeouts;
    std::string message =
        joined("no frame within ", to_ms(patience), " ms of the ",
               by_line() ? "call; is " + options_.trigger_line + " pulsed?" : "trigger");
    if (too_early > 0) {
      message += joined(" (", too_early,
                        " came too early: of pulses before the call, or the camera reads out "
                        "faster than its readout is said to be)");
    }
    throw DeviceError(DeviceErrc::Timeout, name(), message);
  }

  /// The camera's settings, when they are what was asked for.
  CameraState verified(std::chrono::nanoseconds exposure, bool free_running) {
    CameraState state = link_->state();
    require_settings(state, exposure, free_running);
    return state;
  }

  void require_settings(const CameraState& state, std::optional<std::chrono::nanoseconds> exposure,
                        bool free_running) {
    const std::string problem =
        difference(options_, link_->identity(), state, exposure, free_running);
    if (problem.empty()) return;
    ++counters_.wrong_settings;
    throw DeviceError(DeviceErrc::Protocol, name(), "the camera's settings changed: " + problem);
  }

  AravisCameraOptions options_;
  CameraIdentity identity_;
  CameraCounters counters_;
  FrameReader reader_;
  const devices::SteadyClock& clock_;
  LinkOpener opener_;
  std::stop_token stop_;  ///< of connecting
  std::unique_ptr<CameraLink> link_;
  std::uint64_t next_frame_ = 0;
  std::chrono::nanoseconds exposure_set_{0};  ///< the longest that may be under way
  bool lost_ = true;
  bool restart_first_ = false;
};

AravisCamera::AravisCamera(const AravisCameraOptions& options, const devices::SteadyClock& clock,
                           LinkOpener opener, std::stop_token stop)
    : machine_(std::make_unique<Machine>(options, clock, std::move(opener), std::move(stop))) {}
AravisCamera::~AravisCamera() = default;

const std::string& AravisCamera::name() const { return machine_->name(); }
devices::CameraInfo AravisCamera::info() const { return machine_->info(); }
devices::Frame AravisCamera::capture(std::chrono::nanoseconds exposure) {
  return machine_->capture(exposure, [] {});
}
devices::Frame AravisCamera::capture(std::chrono::nanoseconds exposure,
                                     const std::function<void()>& meanwhile) {
  return machine_->capture(exposure, meanwhile);
}
double AravisCamera::temperature_c() { return machine_->temperature_c(); }
void AravisCamera::stream(std::chrono::nanoseconds exposure,
                          const std::function<bool(const devices::Frame&)>& take) {
  machine_->stream(exposure, take);
}
const CameraIdentity& AravisCamera::identity() const { return machine_->identity(); }
CameraCounters AravisCamera::counters() const { return machine_->counters(); }

}  // namespace gonio::aravis_camera
