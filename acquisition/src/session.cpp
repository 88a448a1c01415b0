#include "gonio/acquisition/session.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <set>
#include <stdexcept>
#include <utility>

#include "bracket.h"
#include "exposure_prediction.h"
#include "gonio/acquisition/guarded_devices.h"
#include "gonio/acquisition/preflight.h"
#include "gonio/acquisition/steering.h"
#include "point_schedule.h"
#include "saturation.h"
#include "standing_capture.h"
#include "trust_checks.h"
#include "white_pose.h"

namespace gonio::acquisition {
namespace {

// DeviceSet::begin_subject
constexpr std::uint64_t kDarkSubject = 0;
constexpr std::uint64_t kWhiteSubject = 1;
constexpr std::uint64_t kFirstPointSubject = 2;
/// Behind every point that a plan may have.
constexpr std::uint64_t kSentinelSubject = std::uint64_t(1) << 30U;

/// So many points one after the other that a device failed at are no matter of the points.
constexpr int kFailuresInARow = 5;

class Session {
 public:
  Session(const DeviceSet& devices, const instrument::Instrument& instrument,
          const MeasurementPlan& plan, const SessionOptions& options, SessionWriter& archive,
          const std::function<void(const SessionProgress&)>& progress, std::stop_token stop,
          const SessionPart& part, Steering* steering, const Itinerary& itinerary)
      : devices_(
            devices, instrument.rig, options,
            [&archive](std::chrono::nanoseconds at, const std::string& kind,
                       const std::string& text) { archive.note(at, kind, text); },
            stop),
        instrument_(instrument),
        options_(options),
        archive_(archive),
        progress_(progress),
        part_(part),
        channels_(devices.light->channels()),
        steering_(part.enough ? nullptr : steering),
        white_joints_(white_joints(instrument.rig)),
        checks_(devices_, instrument, plan, options, archive, part, white_joints_),
        points_(plan, part, itinerary) {
    if (part.expectation != nullptr) {
      exposures_.emplace(instrument, options, devices.camera->info(), *part.expectation);
    }
  }

  SessionResult run() {
    started_ = devices_.now();
    try {
      measure();
    } catch (const devices::DeviceError& error) {
      // A stop request latches the axes, and they then say so: that is an interruption, no fault.
      if (!devices_.stop_requested()) {
        archive_.note(devices_.now(), "device error", error.what());
        throw;
      }
      archive_.note(devices_.now(), "stopped", "the session was asked to stop");
    }
    result_.duration_s = seconds_since_start();
    result_.measured = points_.measured();
    result_.planned = points_.planned();
    return std::move(result_);
  }

 private:
  void measure() {
    report("home");
    despite_losses("home", [this] { devices_.home_all(); });
    checks_.compare_with_last_part(
        [this](const std::string& why) { distrust(part_.unchecked, why); });
    report("dark");
    despite_losses("dark", [this] { take_darks(); });
    report("white");
    take_steady_white(WhiteVisit::opening);
    despite_losses("check", [this] {
      begin_subject(kSentinelSubject);
      checks_.visit_sentinel({});
    });
    if (!take_points() || paused()) return;
    report("closing white");
    take_steady_white(WhiteVisit::closing);
    report("park");
    devices_.close_shutter();
    despite_losses("park", [this] { devices_.move_to(instrument_.rig.home()); });
    if (devices_.devices().remarks) {
      for (const std::string& remark : devices_.devices().remarks()) {
        archive_.note(devices_.now(), "devices", remark);
      }
    }
    result_.failed = points_.failed();
    if (!result_.failed.empty()) {
      archive_.note(devices_.now(), "failed",
                    fmt::format("points {}: to be measured again", fmt::join(result_.failed, " ")));
      return;
    }
    archive_.finish(devices_.now());
    result_.finished = true;
    result_.complete = points_.is_complete();
  }

  /// Also those that become suspect, and those that a device failed at, once more. False when asked
  /// to pause.
  bool take_points() {
    consult();
    while (true) {
      if (points_.left().empty()) points_.take_failed_again();
      const bool all_taken = points_.left().empty();
      if (all_taken && (since_check_.empty() || !checks_.can_check())) return true;
      if (paused()) return false;
      // What the itinerary foresees comes at its places, and in time also when points take longer
      // than foreseen or are taken again.
      const bool planned = !all_taken && points_.check_stands_before(*points_.left().begin());
      if (all_taken || (planned && !since_check_.empty()) || checks_.due(since_check_.size())) {
        report("check");
        despite_losses("check", [this] {
          begin_subject(kSentinelSubject);
          checks_.check([this](const std::string& why) { distrust_since_check(why); });
        });
        since_check_.clear();
        continue;
      }
      const int next = *points_.left().begin();
      if (points_.white_stands_before(next) && taken_since_white_) {
        report("white");
        despite_losses("dark", [this] { take_darks(); });
        take_steady_white(WhiteVisit::between);
        continue;
      }
      report("point");
      begin_subject(kFirstPointSubject + static_cast<std::uint64_t>(next));
      take_point(next);
      taken_since_white_ = true;
      consult();
    }
  }

  /// Asks what else to measure, until there is no more to be said.
  void consult() {
    while (steering_ != nullptr) {
      const std::vector<int> left(points_.left().begin(), points_.left().end());
      const auto refusal = [&](const PlannedPoint& point) {
        return why_not_behind(instrument_.rig, points_.plan(), point);
      };
      const std::optional<Decision> decision =
          steering_->decide({points_.plan(), points_.done(), left, refusal});
      if (!decision) return;
      apply(*decision, left, refusal);
    }
  }

  /// Nothing of a decision is done before its note is safe.
  void apply(const Decision& decision, const std::vector<int>& left,
             const std::function<std::string(const PlannedPoint&)>& refusal) {
    MeasurementPlan plan = points_.plan();
    add_points(decision, plan);
    for (std::size_t i = points_.plan().points.size(); i < plan.points.size(); ++i) {
      const std::string why = refusal(plan.points[i]);
      if (!why.empty()) throw std::logic_error("a decision adds a point that cannot be: " + why);
    }
    if (decision.kind == Decision::Kind::enough && decision.dropped != left) {
      throw std::logic_error("a decision drops other points than are left");
    }
    archive_.note(devices_.now(), kDecisionNote, decision_text(decision));
    points_.apply(decision);
    if (decision.kind == Decision::Kind::enough) steering_ = nullptr;
  }

  /// Does it; when a device dropped off meanwhile and comes back, from its beginning again.
  void despite_losses(const char* phase, const std::function<void()>& act) {
    for (int losses = 0;; ++losses) {
      try {
        return act();
      } catch (const devices::DeviceError& error) {
        if (!dropped_off(error.code()) || losses >= options_.retries || devices_.stop_requested()) {
          throw;
        }
        come_back(phase, error);
      }
    }
  }

  void come_back(const char* phase, const devices::DeviceError& error) {
    const rig::Joints believed = devices_.last_reading();
    devices_.come_back();
    archive_.note(devices_.now(), kCameBackNote, fmt::format("{}: {}", phase, error.what()));
    checks_.compare_after_loss(believed,
                               [this](const std::string& why) { distrust_since_check(why); });
  }

  void distrust_since_check(const std::string& why) {
    distrust(std::exchange(since_check_, {}), why);
  }

  /// Points that are not to be taken as good. They are measured again, but not for ever: one that
  /// was measured again already stays, and is marked in what becomes of it.
  void distrust(const std::vector<int>& points, const std::string& why) {
    if (points.empty()) {
      warn(why);
      return;
    }
    archive_.note(devices_.now(), kSuspectNote, suspect_text(points, why));
    result_.warnings.push_back(fmt::format("{} point(s) suspect: {}", points.size(), why));
    for (const int point : points) points_.take_again_once(point);
  }

  void begin_subject(std::uint64_t subject) const {
    if (devices_.devices().begin_subject) devices_.devices().begin_subject(subject);
  }

  /// Whether the session is to end here for now.
  bool paused() {
    if (!part_.pause.stop_requested()) return false;
    devices_.close_shutter();
    archive_.note(devices_.now(), kPausedNote, "the session was asked to pause");
    return true;
  }

  void take_darks() {
    begin_subject(kDarkSubject);
    devices_.close_shutter();
    const auto shortest = devices_.devices().camera->info().min_exposure;
    for (int i = 0; i < options_.dark_frames; ++i) {
      take_dark(FrameKind::dark, -1, shortest);
    }
  }

  enum class WhiteVisit { opening, between, closing };

  /// The light that everything is compared with is not taken from a lamp that flickers.
  void take_steady_white(WhiteVisit visit) {
    bool again = false;
    std::string flicker;
    for (int flickers = 0;; ++flickers) {
      despite_losses(visit == WhiteVisit::closing ? "closing white" : "white", [&] {
        if (std::exchange(again, true)) {
          archive_.note(devices_.now(), kWhiteAgainNote,
                        flicker.empty() ? "a device dropped off" : flicker);
        }
        flicker = take_white(visit);
      });
      if (flicker.empty()) return;
      if (flickers >= options_.retries) {
        throw devices::DeviceError(devices::DeviceErrc::Fault, devices_.devices().light->name(),
                                   "flickers at the white: " + flicker);
      }
    }
  }

  /// All take the same exposures: what differs between them then is the light.
  /// Returns why it was left before its end, to be taken again; empty: it was not.
  std::string take_white(WhiteVisit visit) {
    begin_subject(kWhiteSubject);
    if (options_.white != WhitePlacement::in_frame) devices_.mount(devices::Target::white);
    devices_.move_to(white_joints_);
    const Regions regions = white_regions(instrument_, options_, devices_.joints());
    auto longest = std::chrono::nanoseconds(0);
    for (const devices::LightChannel& channel : channels_) {
      devices_.light(channel.name);
      FrameRecord record;
      record.kind = FrameKind::white;
      record.channel = channel.name;
      const BracketResult found = take_bracket(devices_, instrument_, options_, regions,
                                               options_.first_exposure, record, archive_);
      if (visit != WhiteVisit::opening) checks_.require_lit(channel.name, found.lowest_monitor);
      checks_.set_lit_monitor(channel.name, found.lowest_monitor);
      if (exposures_) {
        exposures_->see_white(channel.name, devices_.joints(), found.brightest_dn_per_s);
      }
      longest = std::max(longest, found.longest);
      if (found.dark_regions == found.regions) {
        const std::string text =
            fmt::format("the white is dark in channel {} even after {:g} s: is the lamp on?",
                        channel.name, devices::to_seconds(found.longest));
        // Without a white nothing that follows would be worth anything.
        if (visit != WhiteVisit::closing) {
          throw devices::DeviceError(devices::DeviceErrc::Fault, devices_.devices().light->name(),
                                     text);
        }
        warn(text);
      }
      if (found.saturated_regions == found.regions && visit != WhiteVisit::closing) {
        throw devices::DeviceError(
            devices::DeviceErrc::Fault, devices_.devices().light->name(),
            fmt::format("the white saturates in channel {} even at the shortest exposure",
                        channel.name));
      }
      if (found.saturated_regions > 0) {
        warn(fmt::format("white saturates in channel {} at the shortest exposure", channel.name));
      }
      double lowest = found.lowest_monitor;
      double highest = found.highest_monitor;
      for (int i = 1; i < options_.white_frames; ++i) {
        FrameRecord repeat = record;
        repeat.monitor = devices_.read_monitor();
        lowest = std::min(lowest, repeat.monitor);
        highest = std::max(highest, repeat.monitor);
        const devices::Frame frame = capture_standing(devices_, found.start, repeat);
        archive_.append(std::move(repeat), frame);
      }
      if (std::string flicker = checks_.flicker(channel.name, lowest, highest); !flicker.empty()) {
        return flicker;
      }
    }
    devices_.close_shutter();
    take_dark(FrameKind::lamp_off, -1, longest);
    if (options_.white != WhitePlacement::in_frame) devices_.mount(devices::Target::sample);
    taken_since_white_ = false;
    return {};
  }

  void take_point(int index) {
    const PlannedPoint planned = points_.plan().points[static_cast<std::size_t>(index)];
    PointRecord point;
    point.point = index;
    point.commanded = planned.direction;
    point.branch = rig::to_char(planned.pose.branch);
    try {
      point.joints = devices_.move_to(planned.pose.joints);
      point.outcome = take_channels(index);
    } catch (const devices::DeviceError& error) {
      // What a retry could not mend at this point may work at the next; anything else ends it all.
      const bool local = error.code() == devices::DeviceErrc::Timeout ||
                         error.code() == devices::DeviceErrc::Protocol;
      if (!(local || dropped_off(error.code())) || devices_.stop_requested()) throw;
      devices_.close_shutter();
      if (local) devices_.stand_still();
      point.outcome = PointOutcome::Failed;
      point.note = error.what();
      warn(fmt::format("point {}: {}", index, error.what()));
      acknowledge(point);
      if (++failures_in_a_row_ >= kFailuresInARow) throw;
      if (local) {
        points_.fail(index);
      } else {
        come_back("point", error);
        points_.take_again(index);
      }
      return;
    }
    acknowledge(point);
    failures_in_a_row_ = 0;
    since_check_.push_back(index);
    if (!flicker_.empty()) distrust({index}, std::exchange(flicker_, {}));
  }

  void acknowledge(PointRecord& point) {
    point.finished_at = devices_.now();
    archive_.append(point);
    points_.acknowledge(point.point, point.outcome);
    result_.points.push_back(point);
  }

  PointOutcome take_channels(int index) {
    const Regions regions =
        regions_of(instrument_, rig::forward(instrument_.rig, devices_.joints()),
                   Eigen::Vector2d::Zero(), options_.sample_half_width_mm);
    if (regions.empty()) {
      warn(fmt::format("point {}: the sample is not in the camera's view", index));
      return PointOutcome::Failed;
    }
    auto longest = std::chrono::nanoseconds(0);
    auto start = options_.first_exposure;
    std::map<std::string, std::chrono::nanoseconds> predicted;
    if (exposures_) {
      predicted = exposures_->at(
          static_cast<std::size_t>(index), devices_.joints(),
          steering_ != nullptr ? steering_->expected() : std::optional<ExpectedSample>());
    }
    bool all_saturated = false;
    bool all_dark = false;
    for (const devices::LightChannel& channel : channels_) {
      devices_.light(channel.name);
      FrameRecord record;
      record.kind = FrameKind::sample;
      record.point = index;
      record.channel = channel.name;
      if (predicted.contains(channel.name)) start = predicted.at(channel.name);
      const BracketResult found =
          take_bracket(devices_, instrument_, options_, regions, start, record, archive_);
      checks_.require_lit(channel.name, found.lowest_monitor);
      if (flicker_.empty()) {
        flicker_ = checks_.flicker(channel.name, found.lowest_monitor, found.highest_monitor);
      }
      start = found.start;
      longest = std::max(longest, found.longest);
      all_saturated = all_saturated || found.saturated_regions == found.regions;
      all_dark = all_dark || found.dark_regions == found.regions;
    }
    devices_.close_shutter();
    take_dark(FrameKind::lamp_off, index, longest);
    if (all_saturated) return PointOutcome::Saturated;
    return all_dark ? PointOutcome::TooDark : PointOutcome::Measured;
  }

  /// A frame behind the closed shutter: an axis that creeps does no harm to it.
  void take_dark(FrameKind kind, int point, std::chrono::nanoseconds exposure) {
    FrameRecord record;
    record.kind = kind;
    record.point = point;
    record.joints = devices_.last_reading();
    record.joints_spread.assign(record.joints.size(), Angle());
    const devices::Frame frame = devices_.capture(exposure);
    if (kind == FrameKind::dark) require_dark(frame);
    archive_.append(std::move(record), frame);
  }

  /// At the shortest exposure nothing but an open shutter fills half the pixels by half.
  void require_dark(const devices::Frame& frame) const {
    // A camera that does not say where it is full is believed to be as its calibration.
    const double full_dn = saturation_level_dn(instrument_.sensor, frame.saturation_level_dn);
    const double bright_dn = 0.5 * (frame.black_level_dn + full_dn);
    const auto bright = std::count_if(frame.pixels_dn.begin(), frame.pixels_dn.end(),
                                      [&](std::uint16_t dn) { return dn > bright_dn; });
    if (2 * static_cast<std::size_t>(bright) < frame.pixels_dn.size()) return;
    throw devices::DeviceError(devices::DeviceErrc::Fault, devices_.devices().light->name(),
                               "a dark frame is bright: is the shutter closed?");
  }

  void warn(std::string text) {
    archive_.note(devices_.now(), "warning", text);
    result_.warnings.push_back(std::move(text));
  }

  double seconds_since_start() const { return devices::to_seconds(devices_.now() - started_); }

  void report(const std::string& phase) const {
    if (!progress_) return;
    SessionProgress now;
    now.phase = phase;
    now.done = static_cast<int>(points_.done().size());
    now.total = points_.planned();
    now.elapsed_s = seconds_since_start();
    now.remaining_s = points_.left_s();
    progress_(now);
  }

  GuardedDevices devices_;
  const instrument::Instrument& instrument_;
  const SessionOptions& options_;
  SessionWriter& archive_;
  const std::function<void(const SessionProgress&)>& progress_;
  const SessionPart& part_;
  std::vector<devices::LightChannel> channels_;
  Steering* steering_;  ///< null: none, or it has said that it is enough
  rig::Joints white_joints_;
  std::chrono::nanoseconds started_{0};
  TrustChecks checks_;
  std::optional<ExposurePrediction> exposures_;
  PointSchedule points_;
  int failures_in_a_row_ = 0;     ///< of points
  std::vector<int> since_check_;  ///< points taken since the last check
  bool taken_since_white_ = false;
  std::string flicker_;  ///< of the lamp, at the point under way; empty: none
  SessionResult result_;
};

}  // namespace

SessionResult run_session(const DeviceSet& devices, const instrument::Instrument& instrument,
                          const MeasurementPlan& plan, const SessionOptions& options,
                          SessionWriter& archive,
                          const std::function<void(const SessionProgress&)>& progress,
                          std::stop_token stop, const SessionPart& part, Steering* steering) {
  const Itinerary itinerary =
      checked_itinerary(devices, instrument, plan, options, part.expectation);
  return Session(devices, instrument, plan, options, archive, progress, std::move(stop), part,
                 steering, itinerary)
      .run();
}

}  // namespace gonio::acquisition
