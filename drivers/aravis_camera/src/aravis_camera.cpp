#include "gonio/aravis_camera/aravis_camera.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <sstream>
#include <thread>
#include <type_traits>
#include <utility>

#include "frame_sequence.h"
#include "gonio/aravis_camera/unpack.h"
#include "gonio/aravis_camera/wire_format.h"

namespace gonio::aravis_camera {

using devices::DeviceErrc;
using devices::DeviceError;

namespace {

// How far what a camera grants may be from what was asked: it rounds to its own steps. What it
// grants is what the frame carries.
constexpr double kExposureTolerance = 0.02;
constexpr double kExposureToleranceUs = 50.0;  // lines of a slow sensor
constexpr double kGainToleranceDb = 0.1;
constexpr double kBlackLevelToleranceUnits = 1.0;

constexpr std::chrono::milliseconds kBetweenAttempts{200};
// A live picture may lose frames, but not all of them.
constexpr int kBadInARow = 20;

std::chrono::nanoseconds host_now() { return std::chrono::steady_clock::now().time_since_epoch(); }

std::chrono::nanoseconds from_us(double us) {
  return std::chrono::nanoseconds(std::llround(us * 1000.0));
}

template <typename... Parts>
std::string joined(const Parts&... parts) {
  std::ostringstream text;
  (text << ... << parts);
  return text.str();
}

bool same(const Region& a, const Region& b) {
  return a.x == b.x && a.y == b.y && a.width == b.width && a.height == b.height;
}

std::string as_text(const Region& region) {
  return joined(region.width, " x ", region.height, " px at ", region.x, ", ", region.y);
}

std::string format_text(std::uint32_t code) {
  const WireFormat* const known = find_wire_format(code);
  return known != nullptr ? std::string(known->name) : joined("0x", std::hex, code);
}

}  // namespace

/// The state machine: connected or not, and the acquisition in order or to be started anew.
class AravisCamera::Machine {
 public:
  Machine(const AravisCameraOptions& options, const devices::SteadyClock& clock, LinkOpener opener)
      : options_(checked(options)),
        format_(*find_wire_format(options_.pixel_format)),
        clock_(clock),
        opener_(std::move(opener)) {
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
    info.pixel_format = format_.layout;
    info.saturation_level_dn = saturation_level();
    info.min_exposure = std::chrono::nanoseconds(std::llround(std::ceil(min_ns())));
    info.max_exposure = std::chrono::nanoseconds(std::llround(std::floor(max_ns())));
    info.readout = options_.readout;
    return info;
  }

  devices::Frame capture(std::chrono::nanoseconds exposure) {
    require_in_range(exposure);
    return with_link([&] {
      for (int attempt = 0;; ++attempt) {
        try {
          return expose(exposure);
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
      link_->set_exposure_us(static_cast<double>(exposure.count()) / 1000.0);
      link_->restart(true);
      sequence_.restart();
      const CameraState state = verified(exposure, true);
      devices::Frame frame;  // its memory serves all
      int bad_in_a_row = 0;
      for (bool more = true; more;) {
        const auto patience = patience_for(exposure);
        const bool came = link_->take_frame(patience, [&](const RawFrame& raw) {
          const std::string problem = problem_of(raw);  // counts it
          bad_in_a_row = problem.empty() ? 0 : bad_in_a_row + 1;
          if (bad_in_a_row > kBadInARow) throw DeviceError(DeviceErrc::Protocol, name(), problem);
          if (bad_in_a_row > 0) return;
          fill(frame, raw, state);
          frame.exposure_start = clock_.now() - frame.exposure - options_.readout;
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

  std::uint16_t saturation_level() const {
    return options_.saturation_level_dn != 0
               ? options_.saturation_level_dn
               : static_cast<std::uint16_t>((1U << static_cast<unsigned>(format_.bits)) - 1U);
  }

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
    require_settings(link_->state(), std::nullopt, false);
    sequence_.restart();
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

  devices::Frame expose(std::chrono::nanoseconds exposure) {
    if (restart_first_) {
      link_->restart(false);
      sequence_.restart();
      restart_first_ = false;
    }
    const auto discard = [&](const RawFrame& raw) {
      ++counters_.unexpected;
      sequence_.next(raw.id, raw.timestamp_ns, host_now());
    };
    link_->set_exposure_us(static_cast<double>(exposure.count()) / 1000.0);
    while (link_->take_frame(std::chrono::nanoseconds(0), discard)) {
    }

    const std::chrono::nanoseconds start = clock_.now();
    if (options_.trigger_line.empty()) link_->trigger();
    std::optional<devices::Frame> frame;
    const auto patience = patience_for(exposure);
    const bool came = link_->take_frame(patience, [&](const RawFrame& raw) {
      const std::string problem = problem_of(raw);
      if (!problem.empty()) throw DeviceError(DeviceErrc::Protocol, name(), problem);
      fill(frame.emplace(), raw, verified(exposure, false));
    });
    if (!came) fail_without_frame(patience);

    frame->exposure_start =
        options_.trigger_line.empty()
            ? start
            : std::max(start, clock_.now() - frame->exposure - options_.readout);
    frame->frame_id = next_frame_++;
    ++counters_.frames;
    return std::move(*frame);
  }

  std::chrono::nanoseconds patience_for(std::chrono::nanoseconds exposure) const {
    return clock_.on_host(exposure + options_.readout) + options_.frame_margin;
  }

  [[noreturn]] void fail_without_frame(std::chrono::nanoseconds patience) {
    ++counters_.timeouts;
    throw DeviceError(
        DeviceErrc::Timeout, name(),
        joined("no frame within ", patience.count() / 1000000, " ms of the ",
               options_.trigger_line.empty() ? "trigger"
                                             : "call; is " + options_.trigger_line + " pulsed?"));
  }

  /// Why a buffer is not a frame; counts it. Empty when it is one.
  std::string problem_of(const RawFrame& raw) {
    const FrameSequence::Verdict verdict = sequence_.next(raw.id, raw.timestamp_ns, host_now());
    counters_.id_gaps += verdict.missing;
    counters_.timestamp_jumps += verdict.jump ? 1 : 0;
    if (!raw.complete) {
      ++counters_.incomplete;
      return joined("frame ", raw.id, " is incomplete: ", raw.problem,
                    "; see network tuning in docs/hardware.md");
    }
    if (!verdict.problem.empty()) {
      ++counters_.out_of_order;
      return joined("frame ", verdict.problem);
    }
    if (raw.pixel_format != format_.code) {
      ++counters_.wrong_settings;
      return joined("frame ", raw.id, " has pixel format ", format_text(raw.pixel_format),
                    ", asked ", format_.name);
    }
    if (raw.width != identity_.region.width || raw.height != identity_.region.height) {
      ++counters_.wrong_settings;
      return joined("frame ", raw.id, " has ", raw.width, " x ", raw.height, " px, asked ",
                    as_text(identity_.region));
    }
    const std::size_t expected = packed_size(format_.packing, pixels());
    if (raw.bytes.size() != expected) {
      ++counters_.incomplete;
      return joined("frame ", raw.id, " has ", raw.bytes.size(), " bytes, expected ", expected);
    }
    return {};
  }

  std::size_t pixels() const {
    return static_cast<std::size_t>(identity_.region.width) *
           static_cast<std::size_t>(identity_.region.height);
  }

  void fill(devices::Frame& frame, const RawFrame& raw, const CameraState& state) const {
    frame.width_px = identity_.region.width;
    frame.height_px = identity_.region.height;
    frame.pixel_format = format_.layout;
    frame.saturation_level_dn = saturation_level();
    frame.black_level_dn = identity_.black_level_feature.empty()
                               ? options_.black_level_dn
                               : state.black_level * options_.black_level_unit_dn;
    frame.gain_db = gain_db(state);
    frame.exposure = from_us(state.exposure_us);
    frame.pixels_dn.resize(pixels());
    unpack(format_.packing, raw.bytes, frame.pixels_dn);
  }

  double gain_db(const CameraState& state) const {
    if (identity_.gain_feature.empty()) return 0.0;
    if (identity_.gain_feature != "GainRaw") return state.gain;
    return options_.gain_raw_per_db > 0.0 ? state.gain / options_.gain_raw_per_db : 0.0;
  }

  /// The camera's settings, when they are what was asked for.
  CameraState verified(std::chrono::nanoseconds exposure, bool free_running) {
    CameraState state = link_->state();
    require_settings(state, exposure, free_running);
    return state;
  }

  void require_settings(const CameraState& state, std::optional<std::chrono::nanoseconds> exposure,
                        bool free_running) {
    const std::string problem = difference(state, exposure, free_running);
    if (problem.empty()) return;
    ++counters_.wrong_settings;
    throw DeviceError(DeviceErrc::Protocol, name(), "the camera's settings changed: " + problem);
  }

  std::string difference(const CameraState& state, std::optional<std::chrono::nanoseconds> exposure,
                         bool free_running) const {
    const CameraIdentity& identity = link_->identity();
    if (!state.automatic.empty()) return state.automatic.front() + " is on";
    if (state.pixel_format != format_.code) {
      return joined("pixel format is ", format_text(state.pixel_format), ", asked ", format_.name);
    }
    if (!same(state.region, identity.region)) {
      return joined("region is ", as_text(state.region), ", asked ", as_text(identity.region));
    }
    if (exposure) {
      const double asked_us = static_cast<double>(exposure->count()) / 1000.0;
      const double allowed = std::max(kExposureTolerance * asked_us, kExposureToleranceUs);
      if (!(std::abs(state.exposure_us - asked_us) <= allowed)) {
        return joined("exposure is ", state.exposure_us, " us, asked ", asked_us, " us");
      }
    }
    if (!identity.gain_feature.empty() && identity.gain_feature != "GainRaw" &&
        !(std::abs(state.gain - options_.gain_db) <= kGainToleranceDb)) {
      return joined("gain is ", state.gain, " dB, asked ", options_.gain_db, " dB");
    }
    if (identity.gain_feature == "GainRaw" && options_.gain_raw_per_db > 0.0 &&
        !(std::abs(state.gain - options_.gain_db * options_.gain_raw_per_db) <= 1.0)) {
      return joined("GainRaw is ", state.gain, ", asked ",
                    options_.gain_db * options_.gain_raw_per_db);
    }
    if (!identity.black_level_feature.empty()) {
      const double asked = options_.black_level_dn / options_.black_level_unit_dn;
      if (!(std::abs(state.black_level - asked) <= kBlackLevelToleranceUnits)) {
        return joined(identity.black_level_feature, " is ", state.black_level, ", asked ", asked);
      }
    }
    if (state.triggered == free_running) {
      return joined("trigger mode is ", state.triggered ? "on" : "off");
    }
    const std::string source = options_.trigger_line.empty() ? "Software" : options_.trigger_line;
    if (!free_running && state.trigger_source != source) {
      return joined("trigger source is ", state.trigger_source, ", asked ", source);
    }
    return {};
  }

  AravisCameraOptions options_;
  const WireFormat& format_;
  const devices::SteadyClock& clock_;
  LinkOpener opener_;
  std::unique_ptr<CameraLink> link_;
  CameraIdentity identity_;
  FrameSequence sequence_;
  CameraCounters counters_;
  std::uint64_t next_frame_ = 0;
  bool lost_ = true;
  bool restart_first_ = false;
};

AravisCamera::AravisCamera(const AravisCameraOptions& options, const devices::SteadyClock& clock,
                           LinkOpener opener)
    : machine_(std::make_unique<Machine>(options, clock, std::move(opener))) {}
AravisCamera::~AravisCamera() = default;

const std::string& AravisCamera::name() const { return machine_->name(); }
devices::CameraInfo AravisCamera::info() const { return machine_->info(); }
devices::Frame AravisCamera::capture(std::chrono::nanoseconds exposure) {
  return machine_->capture(exposure);
}
double AravisCamera::temperature_c() { return machine_->temperature_c(); }
void AravisCamera::stream(std::chrono::nanoseconds exposure,
                          const std::function<bool(const devices::Frame&)>& take) {
  machine_->stream(exposure, take);
}
const CameraIdentity& AravisCamera::identity() const { return machine_->identity(); }
CameraCounters AravisCamera::counters() const { return machine_->counters(); }

}  // namespace gonio::aravis_camera
