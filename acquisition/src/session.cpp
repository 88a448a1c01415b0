#include "gonio/acquisition/session.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <set>
#include <stdexcept>
#include <utility>

#include "dark_frames.h"
#include "gonio/acquisition/preflight.h"
#include "gonio/acquisition/steering.h"
#include "gonio/acquisition/time_left.h"
#include "point_schedule.h"
#include "point_visit.h"
#include "white_pose.h"
#include "white_visit.h"

namespace gonio::acquisition {
namespace {

// DeviceSet::begin_subject
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
        steering_(part.enough ? nullptr : steering),
        white_joints_(white_joints(instrument.rig)),
        checks_(devices_, instrument, plan, options, archive, part, white_joints_),
        ambient_(instrument.sensor, options, [this](std::string text) { warn(std::move(text)); }),
        points_(plan, part, itinerary),
        time_left_(itinerary, plan),
        context_{devices_,
                 instrument,
                 options,
                 archive,
                 checks_,
                 ambient_,
                 exposures_,
                 devices.light->channels(),
                 [this](std::string text) { warn(std::move(text)); }} {
    if (part.expectation != nullptr) {
      exposures_.emplace(instrument, options, devices.camera->info(), *part.expectation);
    }
  }

  SessionResult run() {
    started_ = devices_.now();
    axes_unchecked_ = {part_.unchecked.begin(), part_.unchecked.end()};
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
    result_.measured_now = static_cast<int>(std::count(taken_.begin(), taken_.end(), true));
    result_.suspect = static_cast<int>(suspects_.size());
    result_.planned = points_.planned();
    return std::move(result_);
  }

 private:
  void measure() {
    report("home");
    const auto home = [this] { despite_losses("home", [this] { devices_.home_all(); }); };
    judged(home, [this] {
      const bool compared = checks_.compare_with_last_part(
          [this](const std::string& why) { distrust_unchecked(axes_unchecked_, why); });
      if (compared) axes_unchecked_.clear();
    });
    report("dark");
    despite_losses("dark", [this] { take_darks(context_); });
    report("white");
    take_steady_white(WhiteVisit::opening);
    despite_losses("check", [this] {
      begin_subject(context_, kSentinelSubject);
      checks_.visit_sentinel({});
    });
    if (checks_.awaits_sentinel()) {
      throw devices::DeviceError(devices::DeviceErrc::Fault, devices_.devices().light->name(),
                                 "no steady light at the sentinel");
    }
    std::string unbridged = checks_.compare_light_with_last_part();
    if (!unbridged.empty()) result_.warnings.push_back(std::move(unbridged));
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
      if (all_taken && (since_check_ == 0 || !checks_.can_check())) return true;
      if (paused()) return false;
      // What the itinerary foresees comes at its places, and in time also when points take longer
      // than foreseen or are taken again.
      const bool planned = !all_taken && points_.check_stands_before(*points_.left().begin());
      if (!all_taken) time_left_.comes_to(*points_.left().begin());
      if (all_taken || (planned && since_check_ > 0) || checks_.due(since_check_)) {
        report("check");
        despite_losses("check", [this, all_taken] {
          begin_subject(context_, kSentinelSubject);
          const TrustChecks::Compared compared = checks_.check(
              [this](const std::string& why) { distrust_unchecked(axes_unchecked_, why); },
              [this](const std::string& why) { distrust_unchecked(light_unchecked_, why); });
          if (compared.axes) axes_unchecked_.clear();
          if (compared.light) light_unchecked_.clear();
          // Homing has put right what may have been lost, so no later check can tell; and behind
          // the last sentinel there is none that could.
          if (!axes_unchecked_.empty()) {
            distrust_unchecked(axes_unchecked_,
                               "an axis could not tell whether it was in order (home delta)");
          }
          if (all_taken && !light_unchecked_.empty()) {
            distrust_unchecked(light_unchecked_, "the last sentinel could not be read");
          }
        });
        since_check_ = 0;
        continue;
      }
      const int next = *points_.left().begin();
      if (points_.white_stands_before(next) && taken_since_white_) {
        report("white");
        despite_losses("dark", [this] { take_darks(context_); });
        take_steady_white(WhiteVisit::between);
        continue;
      }
      report("point", next);
      begin_subject(context_, kFirstPointSubject + static_cast<std::uint64_t>(next));
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
          decided({points_.plan(), points_.done(), left, refusal});
      if (!decision) return;
      apply(*decision, left, refusal);
    }
  }

  /// By this session's own archive: a decision is for good, and steering finds it by its name.
  std::optional<Decision> decided(const SessionSoFar& now) {
    std::optional<Decision> decision;
    try {
      decision = steering_->decide(now);
    } catch (const std::exception&) {
      archive_.require_in_place();  // else that is why
      throw;
    }
    archive_.require_in_place();
    return decision;
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
    const std::string what = fmt::format("{}: {}", phase, error.what());
    const auto home = [&] {
      devices_.come_back([&] { archive_.note(devices_.now(), kDroppedOffNote, what); });
      archive_.note(devices_.now(), kCameBackNote, what);
    };
    judged(home, [&] {
      checks_.compare_after_loss(
          believed, [this](const std::string& why) { distrust_unchecked(axes_unchecked_, why); });
    });
  }

  /// Also where it fails: the next part finds some axes homed, and no longer what that has found.
  static void judged(const std::function<void()>& homing, const std::function<void()>& judge) {
    try {
      homing();
    } catch (const devices::DeviceError&) {
      judge();
      throw;
    }
    judge();
  }

  /// Of axes_unchecked_ or light_unchecked_.
  void distrust_unchecked(std::set<int>& unchecked, const std::string& why) {
    const std::set<int> points = std::exchange(unchecked, {});
    for (const int point : points) {
      axes_unchecked_.erase(point);
      light_unchecked_.erase(point);
    }
    since_check_ = 0;
    distrust(points, why);
  }

  /// Points that are not to be taken as good. They are measured again, but not for ever: one that
  /// was measured again already stays, and is marked in what becomes of it.
  void distrust(const std::set<int>& points, const std::string& why) {
    if (points.empty()) {
      warn(why);
      return;
    }
    archive_.note(devices_.now(), kSuspectNote, suspect_text({points.begin(), points.end()}, why));
    result_.warnings.push_back(fmt::format("{} point(s) suspect: {}", points.size(), why));
    for (const int point : points) points_.take_again_once(point);
    suspects_.insert(points.begin(), points.end());
  }

  /// Whether the session is to end here for now.
  bool paused() {
    if (!part_.pause.stop_requested()) return false;
    devices_.close_shutter();
    archive_.note(devices_.now(), kPausedNote, "the session was asked to pause");
    return true;
  }

  /// The light that everything is compared with is not taken from a lamp that flickers, nor in a
  /// room whose light changes.
  void take_steady_white(WhiteVisit visit) {
    for (int tries = 0;; ++tries) {
      std::string unsteady;
      bool begun = false;
      despite_losses(visit == WhiteVisit::closing ? "closing white" : "white", [&] {
        if (std::exchange(begun, true)) {
          archive_.note(devices_.now(), kWhiteAgainNote, "a device dropped off");
        }
        unsteady = visit_white(context_, white_joints_, visit);
      });
      if (unsteady.empty()) {
        taken_since_white_ = false;
        return;
      }
      if (tries >= options_.retries) {
        throw devices::DeviceError(devices::DeviceErrc::Fault, devices_.devices().light->name(),
                                   "no steady light at the white: " + unsteady);
      }
    }
  }

  void take_point(int index) {
    const PlannedPoint planned = points_.plan().points[static_cast<std::size_t>(index)];
    PointRecord point;
    point.point = index;
    point.commanded = planned.direction;
    point.branch = rig::to_char(planned.pose.branch);
    const std::chrono::nanoseconds begun = devices_.now();
    std::string unsteady;
    try {
      point.joints = devices_.move_to(planned.pose.joints);
      PointFrames frames = take_point_frames(
          context_, index,
          steering_ != nullptr ? steering_->expected() : std::optional<ExpectedSample>());
      point.outcome = frames.outcome;
      unsteady = std::move(frames.unsteady);
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
    // A session that ends in between must not leave it as good.
    archive_.together([&] {
      acknowledge(point);
      if (!unsteady.empty()) distrust({index}, unsteady);
    });
    time_left_.took(index, devices::to_seconds(point.finished_at - begun));
    failures_in_a_row_ = 0;
    ++since_check_;
    axes_unchecked_.insert(index);
    light_unchecked_.insert(index);
  }

  void acknowledge(PointRecord& point) {
    point.finished_at = devices_.now();
    archive_.append(point);
    points_.acknowledge(point.point, point.outcome);
    if (point.outcome == PointOutcome::Measured) {
      const auto index = static_cast<std::size_t>(point.point);
      taken_.resize(std::max(taken_.size(), index + 1));
      taken_[index] = true;
    }
    suspects_.erase(point.point);
  }

  void warn(std::string text) {
    archive_.note(devices_.now(), "warning", text);
    result_.warnings.push_back(std::move(text));
  }

  double seconds_since_start() const { return devices::to_seconds(devices_.now() - started_); }

  void report(const std::string& phase, std::optional<int> point = {}) const {
    if (!progress_) return;
    SessionProgress now;
    now.phase = phase;
    now.point = point;
    now.done = static_cast<int>(points_.done().size());
    now.total = points_.planned();
    now.elapsed_s = seconds_since_start();
    now.remaining_s = time_left_.from(phase, points_.left());
    progress_(now);
  }

  GuardedDevices devices_;
  const instrument::Instrument& instrument_;
  const SessionOptions& options_;
  SessionWriter& archive_;
  const std::function<void(const SessionProgress&)>& progress_;
  const SessionPart& part_;
  Steering* steering_;  ///< null: none, or it has said that it is enough
  rig::Joints white_joints_;
  std::chrono::nanoseconds started_{0};
  TrustChecks checks_;
  AmbientWatch ambient_;
  std::optional<ExposurePrediction> exposures_;
  PointSchedule points_;
  TimeLeft time_left_;
  CaptureContext context_;
  int failures_in_a_row_ = 0;    ///< of points
  std::size_t since_check_ = 0;  ///< points taken since the last check
  /// Points since every axis that tells was found in order, also of the part before.
  std::set<int> axes_unchecked_;
  std::set<int> light_unchecked_;  ///< points since a sentinel was compared with the one before
  std::vector<bool> taken_;        ///< by point: measured in this part
  std::set<int> suspects_;         ///< and not measured since they became it
  bool taken_since_white_ = false;
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
