#include "gonio/acquisition/session.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <stdexcept>
#include <utility>

#include "bracket.h"
#include "gonio/acquisition/guarded_devices.h"
#include "gonio/acquisition/itinerary.h"
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

class Session {
 public:
  Session(const DeviceSet& devices, const instrument::Instrument& instrument,
          const MeasurementPlan& plan, const SessionOptions& options, SessionWriter& archive,
          const std::function<void(const SessionProgress&)>& progress, std::stop_token stop,
          const SessionPart& part)
      : devices_(
            devices, instrument.rig, options,
            [&archive](std::chrono::nanoseconds at, const std::string& kind,
                       const std::string& text) { archive.note(at, kind, text); },
            stop),
        instrument_(instrument),
        plan_(plan),
        options_(options),
        archive_(archive),
        progress_(progress),
        part_(part),
        channels_(devices.light->channels()),
        white_joints_(white_joints(instrument.rig)),
        checks_(devices_, instrument, plan, options, archive, part, white_joints_),
        done_(part.done) {}

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
    count_measured();
    return std::move(result_);
  }

 private:
  void measure() {
    report("home");
    devices_.home_all();
    checks_.compare_with_last_part(
        [this](const std::string& why) { distrust(part_.unchecked, why); });
    report("dark");
    begin_subject(kDarkSubject);
    take_darks();
    report("white");
    take_white(WhiteVisit::opening);
    begin_subject(kSentinelSubject);
    checks_.visit_sentinel({});
    if (!take_points() || paused()) return;
    report("closing white");
    take_white(WhiteVisit::closing);
    report("park");
    devices_.close_shutter();
    devices_.move_to(instrument_.rig.home());
    if (devices_.devices().remarks) {
      for (const std::string& remark : devices_.devices().remarks()) {
        archive_.note(devices_.now(), "devices", remark);
      }
    }
    archive_.finish(devices_.now());
    result_.finished = true;
    count_measured();
    result_.complete = result_.measured == static_cast<int>(plan_.points.size());
  }

  /// Also those that become suspect, once more. False when asked to pause.
  bool take_points() {
    while (true) {
      const int next = next_point();
      const bool all_taken = next == static_cast<int>(plan_.points.size());
      if (all_taken && (since_check_.empty() || !checks_.can_check())) return true;
      if (paused()) return false;
      if (all_taken || checks_.due(since_check_.size())) {
        report("check");
        begin_subject(kSentinelSubject);
        checks_.check([this](const std::string& why) { distrust(since_check_, why); });
        since_check_.clear();
        continue;
      }
      report("point");
      begin_subject(kFirstPointSubject + static_cast<std::uint64_t>(next));
      take_point(next);
      since_check_.push_back(next);
    }
  }

  int next_point() const {
    int next = 0;
    while (done_.contains(next)) ++next;
    return next;
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
    for (const int point : points) {
      if (taken_again_.insert(point).second) done_.erase(point);
    }
  }

  void count_measured() {
    result_.measured =
        static_cast<int>(std::count_if(done_.begin(), done_.end(), [](const auto& point) {
          return point.second == PointOutcome::Measured;
        }));
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
    devices_.close_shutter();
    const auto shortest = devices_.devices().camera->info().min_exposure;
    for (int i = 0; i < options_.dark_frames; ++i) {
      take_dark(FrameKind::dark, -1, shortest);
    }
  }

  enum class WhiteVisit { opening, closing };

  /// Opening and closing take the same exposures: what differs between them then is the light.
  void take_white(WhiteVisit visit) {
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
      checks_.set_lit_monitor(channel.name, found.lowest_monitor);
      longest = std::max(longest, found.longest);
      if (found.dark_regions == found.regions) {
        const std::string text =
            fmt::format("the white is dark in channel {} even after {:g} s: is the lamp on?",
                        channel.name, devices::to_seconds(found.longest));
        // Without a white nothing that follows would be worth anything.
        if (visit == WhiteVisit::opening) {
          throw devices::DeviceError(devices::DeviceErrc::Fault, devices_.devices().light->name(),
                                     text);
        }
        warn(text);
      }
      if (found.saturated_regions > 0) {
        warn(fmt::format("white saturates in channel {} at the shortest exposure", channel.name));
      }
      for (int i = 1; i < options_.white_frames; ++i) {
        FrameRecord repeat = record;
        repeat.monitor = devices_.read_monitor();
        const devices::Frame frame = capture_standing(devices_, found.start, repeat);
        archive_.append(std::move(repeat), frame);
      }
    }
    devices_.close_shutter();
    take_dark(FrameKind::lamp_off, -1, longest);
    if (options_.white != WhitePlacement::in_frame) devices_.mount(devices::Target::sample);
  }

  void take_point(int index) {
    const PlannedPoint& planned = plan_.points[static_cast<std::size_t>(index)];
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
      if (!local || devices_.stop_requested()) throw;
      devices_.close_shutter();
      devices_.stand_still();
      point.outcome = PointOutcome::Failed;
      point.note = error.what();
      warn(fmt::format("point {}: {}", index, error.what()));
    }
    point.finished_at = devices_.now();
    archive_.append(point);
    done_[index] = point.outcome;
    if (!flicker_.empty()) distrust({index}, std::exchange(flicker_, {}));
    result_.points.push_back(std::move(point));
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
    bool all_saturated = false;
    bool all_dark = false;
    for (const devices::LightChannel& channel : channels_) {
      devices_.light(channel.name);
      FrameRecord record;
      record.kind = FrameKind::sample;
      record.point = index;
      record.channel = channel.name;
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
    archive_.append(std::move(record), frame);
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
    now.done = static_cast<int>(done_.size());
    now.total = static_cast<int>(plan_.points.size());
    now.elapsed_s = seconds_since_start();
    for (int i = 0; i < now.total; ++i) {
      if (done_.contains(i)) continue;
      now.remaining_s += plan_.points[static_cast<std::size_t>(i)].predicted_s;
    }
    progress_(now);
  }

  GuardedDevices devices_;
  const instrument::Instrument& instrument_;
  const MeasurementPlan& plan_;
  const SessionOptions& options_;
  SessionWriter& archive_;
  const std::function<void(const SessionProgress&)>& progress_;
  const SessionPart& part_;
  std::vector<devices::LightChannel> channels_;
  rig::Joints white_joints_;
  std::chrono::nanoseconds started_{0};
  TrustChecks checks_;
  std::map<int, PointOutcome> done_;
  std::vector<int> since_check_;  ///< points taken since the last check
  std::set<int> taken_again_;     ///< suspects of this run
  std::string flicker_;           ///< of the lamp, at the point under way; empty: none
  SessionResult result_;
};

}  // namespace

void SessionOptions::validate() const {
  const auto require = [](bool ok, const char* field, double value, const char* expected) {
    if (!ok) {
      throw PreflightError(fmt::format("session: {} is {}, expected {}", field, value, expected));
    }
  };
  using Microseconds = std::chrono::duration<double, std::micro>;
  require(first_exposure.count() > 0, "first_exposure_us", Microseconds(first_exposure).count(),
          "above 0");
  require(max_exposure >= first_exposure, "max_exposure_us", Microseconds(max_exposure).count(),
          "at least first_exposure_us");
  require(bracket_ratio > 1.0 && bracket_ratio <= 64.0, "bracket_ratio", bracket_ratio,
          "above 1, at most 64");
  require(max_exposures >= 1 && max_exposures <= 64, "max_exposures", max_exposures, "1 to 64");
  require(relative_sigma > 0.0 && relative_sigma < 1.0, "relative_sigma", relative_sigma,
          "between 0 and 1");
  require(spot_half_width_mm > 0.0 && spot_half_width_mm < sample_half_width_mm,
          "spot_half_width_mm", spot_half_width_mm, "above 0, below sample_half_width_mm");
  require(white_frames >= 1 && white_frames <= 1000, "white_frames", white_frames, "1 to 1000");
  require(dark_frames >= 1 && dark_frames <= 1000, "dark_frames", dark_frames, "1 to 1000");
  require(sample_half_width_mm > 0.0, "sample_half_width_mm", sample_half_width_mm, "above 0");
  const double white_mm = white_half_width_mm.value_or(sample_half_width_mm);
  require(white_mm > 0.0, "white_half_width_mm", white_mm, "above 0");
  require(white_patch_half_width_mm > 0.0, "white_patch_half_width_mm", white_patch_half_width_mm,
          "above 0");
  require(sentinel_every >= 0 && sentinel_every <= 100000, "sentinel_every", sentinel_every,
          "0 to 100000");
  require(sentinel_interval.count() > 0, "sentinel_interval_min",
          devices::to_seconds(sentinel_interval) / 60.0, "above 0");
  require(retries >= 0 && retries <= 100, "retries", retries, "0 to 100");
  require(move_timeout.count() > 0, "move_timeout_s", devices::to_seconds(move_timeout), "above 0");
}

SessionResult run_session(const DeviceSet& devices, const instrument::Instrument& instrument,
                          const MeasurementPlan& plan, const SessionOptions& options,
                          SessionWriter& archive,
                          const std::function<void(const SessionProgress&)>& progress,
                          std::stop_token stop, const SessionPart& part) {
  check_before_motion(devices, instrument, plan, options);
  return Session(devices, instrument, plan, options, archive, progress, std::move(stop), part)
      .run();
}

}  // namespace gonio::acquisition
