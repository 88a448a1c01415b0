#include "gonio/acquisition/preflight.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <stdexcept>
#include <tuple>
#include <vector>

#include "gonio/devices/clock.h"
#include "session_checks.h"
#include "steering_checks.h"
#include "white_pose.h"

namespace gonio::acquisition {
namespace {

template <class... Parts>
[[noreturn]] void refuse(fmt::format_string<Parts...> text, Parts&&... parts) {
  throw PreflightError("pre-run check: " + fmt::format(text, std::forward<Parts>(parts)...));
}

void check_axes(const DeviceSet& devices, const rig::RigDescription& rig) {
  if (devices.stages.size() != rig.axes.size()) {
    refuse("{} stages for the {} axes of rig {}", devices.stages.size(), rig.axes.size(), rig.name);
  }
  constexpr Angle kTolerance = Angle::from_radians(1e-9);
  for (std::size_t i = 0; i < rig.axes.size(); ++i) {
    const rig::Axis& axis = rig.axes[i];
    const devices::RotationStage* stage = devices.stages[i];
    if (stage == nullptr) refuse("axis {} has no stage", axis.name);
    if (stage->name() != axis.name) {
      refuse("stage {} stands where the rig has axis {}", stage->name(), axis.name);
    }
    const devices::JointLimits limits = stage->limits();
    if (axis.min < limits.min - kTolerance || axis.max > limits.max + kTolerance) {
      refuse("axis {}: the rig allows {:.3f} to {:.3f} deg, the stage only {:.3f} to {:.3f} deg",
             axis.name, axis.min.degrees(), axis.max.degrees(), limits.min.degrees(),
             limits.max.degrees());
    }
  }
}

}  // namespace

void check_points(const MeasurementPlan& plan, const rig::RigDescription& rig) {
  if (plan.points.empty()) refuse("no direction to measure");
  if (!plan.refused.empty()) {
    const RefusedDirection& first = plan.refused.front();
    refuse("{} of {} directions cannot be measured, the first ({:g}, {:g}, {:g}) deg: {}: {}",
           plan.refused.size(), plan.refused.size() + plan.points.size(),
           first.direction.angles.theta_h.degrees(), first.direction.angles.theta_d.degrees(),
           first.direction.angles.phi_d.degrees(), rig::to_string(first.refusal.reason),
           first.refusal.detail);
  }
  std::set<std::tuple<double, double, double>> seen;
  for (const PlannedPoint& point : plan.points) {
    const auto& d = point.direction;
    const bool first =
        seen.insert({d.theta_h.radians(), d.theta_d.radians(), d.phi_d.radians()}).second;
    if (!first && !point.again) {
      refuse("direction ({:g}, {:g}, {:g}) deg stands twice in the plan", d.theta_h.degrees(),
             d.theta_d.degrees(), d.phi_d.degrees());
    }
    if (point.pose.joints.size() != rig.axes.size()) {
      refuse("a pose of {} joints for {} axes", point.pose.joints.size(), rig.axes.size());
    }
    constexpr Angle kTolerance = Angle::from_radians(1e-9);
    for (std::size_t i = 0; i < rig.axes.size(); ++i) {
      const rig::Axis& axis = rig.axes[i];
      const Angle joint = point.pose.joints[i];
      if (!(joint >= axis.min - kTolerance && joint <= axis.max + kTolerance)) {
        refuse("axis {}: a pose at {:.4f} deg, limits {:.4f} to {:.4f} deg", axis.name,
               joint.degrees(), axis.min.degrees(), axis.max.degrees());
      }
    }
  }
}

namespace {

void check_camera(const DeviceSet& devices, const instrument::Instrument& instrument,
                  const SessionOptions& options) {
  const devices::CameraInfo info = devices.camera->info();
  if (info.width_px != instrument.camera.width_px ||
      info.height_px != instrument.camera.height_px) {
    refuse("camera {} gives {} x {} px, the calibration is for {} x {} px", devices.camera->name(),
           info.width_px, info.height_px, instrument.camera.width_px, instrument.camera.height_px);
  }
  const double shortest_s =
      std::chrono::duration<double>(info.min_exposure).count() + instrument.sensor.shutter_offset_s;
  if (!(shortest_s > 0.0)) {
    refuse(
        "the calibration's shutter_offset_s, {:g} us, is more than the shortest exposure of "
        "camera {}, {} us: calibrate again",
        1e6 * instrument.sensor.shutter_offset_s, devices.camera->name(),
        info.min_exposure.count() / 1000);
  }
  if (options.first_exposure < info.min_exposure || options.first_exposure > info.max_exposure) {
    refuse("first exposure {} us, camera {} has {} to {} us", options.first_exposure.count() / 1000,
           devices.camera->name(), info.min_exposure.count() / 1000,
           info.max_exposure.count() / 1000);
  }
}

/// Collects what checks come to.
class CheckList {
 public:
  explicit CheckList(std::vector<Check>& checks) : checks_(checks) {}

  /// `check` returns a phrase for people or throws PreflightError. True when it passed.
  template <class CheckFunction>
  bool run(const char* name, const CheckFunction& check) {
    try {
      checks_.push_back({name, CheckResult::pass, check()});
      return true;
    } catch (const PreflightError& error) {
      checks_.push_back({name, CheckResult::refuse, error.what()});
      return false;
    }
  }
  void note(const char* name, std::string text) {
    checks_.push_back({name, CheckResult::note, std::move(text)});
  }
  void pass(const char* name, std::string text) {
    checks_.push_back({name, CheckResult::pass, std::move(text)});
  }

 private:
  std::vector<Check>& checks_;
};

std::vector<AxisUse> axis_use(const rig::RigDescription& rig, const Itinerary& itinerary) {
  std::vector<AxisUse> uses;
  for (std::size_t k = 0; k < rig.axes.size(); ++k) {
    const rig::Axis& axis = rig.axes[k];
    AxisUse use{axis.name, axis.home, axis.home, Angle(), 0};
    Angle at = axis.home;
    const auto go = [&](Angle to) {
      if (to == at) return;
      const Angle below = to - rig::overshoot(axis, at, to);
      use.lowest = std::min(use.lowest, below);
      use.highest = std::max(use.highest, to);
      use.travelled += abs(below - at) + abs(to - below);
      ++use.moves;
      at = to;
    };
    for (const PlannedVisit& visit : itinerary.visits) {
      for (const rig::Joints& stop : visit.via) go(stop[k]);
      go(visit.pose.joints[k]);
    }
    uses.push_back(use);
  }
  return uses;
}

std::string path_text(const std::vector<AxisUse>& uses) {
  std::string text;
  for (const AxisUse& use : uses) {
    text += fmt::format("{}{} {:.2f} to {:.2f} deg", text.empty() ? "" : ", ", use.name,
                        use.lowest.degrees(), use.highest.degrees());
  }
  return text;
}

/// An axis with a whole turn or more between its limits could reach a pose in two ways; the moves
/// are from joint angle to joint angle and never the short way round.
void check_turns(const rig::RigDescription& rig, CheckList& checks) {
  for (const rig::Axis& axis : rig.axes) {
    if (axis.max - axis.min < Angle::from_degrees(360.0)) continue;
    checks.note("turns", fmt::format("axis {} may turn from {:g} to {:g} deg: poses a turn apart "
                                     "are taken as given, never the short way round",
                                     axis.name, axis.min.degrees(), axis.max.degrees()));
    return;
  }
  checks.pass("turns", "no axis can turn once round");
}

void check_approach(const rig::RigDescription& rig, CheckList& checks) {
  std::string either;
  for (const rig::Axis& axis : rig.axes) {
    if (axis.approach_overshoot > Angle()) continue;
    either += (either.empty() ? "" : ", ") + axis.name;
  }
  if (either.empty()) {
    checks.pass("approach", "every axis comes to every pose with a rising angle");
  } else {
    checks.note("approach", either +
                                " come to poses from either side: play, if there is any, is "
                                "in the poses (approach_overshoot_deg)");
  }
}

void check_drift(const DriftAliasing& drift, std::size_t points, CheckList& checks) {
  const std::string text = fmt::format(
      "time against theta_h {:+.2f}, theta_d {:+.2f}, phi_d {:+.2f}; all three explain {:.0f} % of "
      "it",
      drift.theta_h, drift.theta_d, drift.phi_d, 100.0 * drift.explained);
  // Below so many points three angles follow any order.
  constexpr std::size_t kFewPoints = 10;
  constexpr double kMuch = 0.5;
  if (points >= kFewPoints && drift.explained > kMuch) {
    checks.note("drift", text + ": a drift the whites do not see would look like the material");
  } else {
    checks.pass("drift", text);
  }
}

void check_exposures(const Forecast& forecast, const SessionOptions& options,
                     const std::string& source, CheckList& checks) {
  const auto count = [&](bool ForecastPoint::*flag) {
    return std::count_if(forecast.points.begin(), forecast.points.end(),
                         [&](const ForecastPoint& point) { return point.*flag; });
  };
  const auto total = static_cast<std::ptrdiff_t>(forecast.points.size());
  const std::ptrdiff_t out_of_view = total - count(&ForecastPoint::in_view);
  checks.run("view", [&] {
    if (out_of_view == total) refuse("the camera sees nothing of the sample at any point");
    return fmt::format("the camera sees the sample at {} of {} points", total - out_of_view, total);
  });
  double shortest_s = std::numeric_limits<double>::infinity();
  double longest_s = 0.0;
  for (const ForecastPoint& point : forecast.points) {
    for (const ForecastBracket& bracket : point.channels) {
      shortest_s = std::min(shortest_s, bracket.shortest_s);
      longest_s = std::max(longest_s, bracket.longest_s);
    }
  }
  if (longest_s == 0.0) return;
  std::string text = fmt::format("{:.4g} to {:.4g} ms if it is like {}", 1e3 * shortest_s,
                                 1e3 * longest_s, source);
  std::string problems;
  const auto add = [&](std::ptrdiff_t points, const std::string& what) {
    if (points > 0) problems += fmt::format("; {} of {} points {}", points, total, what);
  };
  add(count(&ForecastPoint::saturates), "saturate somewhere even in the shortest");
  add(count(&ForecastPoint::dark), "stay dark somewhere even in the longest");
  add(count(&ForecastPoint::short_of_sigma),
      fmt::format("stay above relative_sigma {:g} somewhere", options.relative_sigma));
  if (problems.empty()) {
    checks.pass("exposure", text);
  } else {
    checks.note("exposure", text + problems);
  }
}

void set_dwells(const Forecast& forecast, Itinerary& itinerary) {
  for (std::size_t i = 0; i < itinerary.visits.size(); ++i) {
    itinerary.visits[i].dwell_s = forecast.dwells_s.at(i);
  }
}

}  // namespace

std::string_view to_string(CheckResult result) {
  switch (result) {
    case CheckResult::pass:
      return "pass";
    case CheckResult::note:
      return "note";
    case CheckResult::refuse:
      return "refuse";
  }
  return "";
}

const Check* Preflight::refusal() const {
  const auto found = std::find_if(checks.begin(), checks.end(), [](const Check& check) {
    return check.result == CheckResult::refuse;
  });
  return found == checks.end() ? nullptr : &*found;
}

Preflight preflight(const DeviceSet& devices, const instrument::Instrument& instrument,
                    const MeasurementPlan& plan, const SessionOptions& options,
                    const Expectation* expectation) {
  Preflight result;
  CheckList checks(result.checks);
  bool ok = checks.run("options", [&] {
    options.validate();
    return std::string("within their ranges");
  });
  ok &= checks.run("instrument", [&] {
    try {
      instrument.validate();
    } catch (const std::invalid_argument& error) {
      throw PreflightError(error.what());
    }
    return instrument.id;
  });
  // What follows looks at what these have in them.
  ok = ok && checks.run("devices", [&] {
    if (devices.camera == nullptr) refuse("no camera");
    if (devices.light == nullptr) refuse("no light source");
    if (devices.clock == nullptr) refuse("no clock");
    check_axes(devices, instrument.rig);
    return fmt::format("{} axes, camera, light{}{}", devices.stages.size(),
                       devices.monitor != nullptr ? ", lamp monitor" : "",
                       devices.changer != nullptr ? ", target changer" : "");
  });
  if (!ok) return result;
  bool points_ok = checks.run("points", [&] {
    check_points(plan, instrument.rig);
    return fmt::format("{} directions, each once, with poses within the limits",
                       plan.points.size());
  });
  checks.run("camera", [&] {
    check_camera(devices, instrument, options);
    return fmt::format("{} x {} px as the calibration", instrument.camera.width_px,
                       instrument.camera.height_px);
  });
  checks.run("light", [&] {
    if (devices.light->channels().empty()) {
      refuse("light {} has no channel", devices.light->name());
    }
    return fmt::format("{} channels", devices.light->channels().size());
  });
  rig::Joints white;
  const bool white_ok = checks.run("white", [&] {
    if (options.white != WhitePlacement::in_frame && devices.changer == nullptr) {
      refuse("the white is to be changed in, but there is no target changer");
    }
    white = white_joints(instrument.rig);
    if (!white_in_view(instrument, options, white)) {
      refuse("the white reference is not in the camera's view");
    }
    return std::string("in view at its pose");
  });
  if (!points_ok || !white_ok) return result;
  const rig::TravelModel travel(instrument.rig);
  const auto foreseen = [&](const Itinerary& itinerary) {
    return forecast_session(instrument, itinerary, plan, options, devices.camera->info(),
                            expectation->light, expectation->sample, expectation->times);
  };
  Itinerary itinerary;
  const bool way_ok = checks.run("path", [&] {
    itinerary = session_itinerary(travel, plan, white);
    // By the clock checks stand where they will be due by the best that is known of the points.
    if (expectation != nullptr) set_dwells(foreseen(itinerary), itinerary);
    itinerary = with_session_checks(travel, itinerary, options,
                                    SessionChecks::of(plan, options, tells_home_delta(devices)));
    result.axes = axis_use(instrument.rig, itinerary);
    return path_text(result.axes);
  });
  if (!way_ok) return result;
  check_turns(instrument.rig, checks);
  check_approach(instrument.rig, checks);
  if (expectation != nullptr && !result.refusal()) {
    result.forecast = foreseen(itinerary);
    check_exposures(*result.forecast, options, expectation->sample.source, checks);
    set_dwells(*result.forecast, itinerary);
  }
  result.drift = drift_aliasing(itinerary, plan);
  check_drift(result.drift, plan.points.size(), checks);
  result.itinerary = std::move(itinerary);
  return result;
}

Itinerary checked_itinerary(const DeviceSet& devices, const instrument::Instrument& instrument,
                            const MeasurementPlan& plan, const SessionOptions& options,
                            const Expectation* expectation) {
  Preflight found = preflight(devices, instrument, plan, options, expectation);
  if (const Check* refusal = found.refusal()) throw PreflightError(refusal->text);
  return std::move(*found.itinerary);
}

}  // namespace gonio::acquisition
