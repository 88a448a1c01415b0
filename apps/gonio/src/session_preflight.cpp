#include "session_preflight.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <numbers>

#include "gonio/brdf/diffuse_models.h"
#include "gonio/console/console.h"
#include "gonio/opened_rig/opened_rig.h"
#include "gonio/rig/tour_bound.h"
#include "gonio/setup/simulated_rig.h"
#include "planning.h"

namespace gonio::cli {
namespace {

using acquisition::Check;
using acquisition::CheckResult;

/// How well a rig file knows lamp and camera together, as a logarithm: its own world but for the
/// lamp's drift; a world that is hidden, or metal.
constexpr double kLightOfOwnWorld = 0.02;
constexpr double kLightUnknown = 0.3;

/// A sample named as expected is it up to a tilt and where a highlight falls.
constexpr double kNamedPoint = 0.1;
/// A plan made from a basis expects an average material: what materials differ by.
constexpr double kAverageSample = 0.7;
constexpr double kAveragePoint = 0.5;
/// Without a word: a grey diffuser, three times as bright or as dark, and highlights anywhere.
constexpr double kUnknownAlbedo = 0.2;
constexpr double kUnknownSample = 1.1;
constexpr double kUnknownPoint = 0.7;

/// What a frame takes on a rig of metal besides exposure and readout (transfer, encoders, monitor,
/// file), a leg besides the drives' own time, and how well both and the drives' speed are known.
/// Measured over the wire: docs/results.md.
constexpr double kMetalFrame_s = 0.05;
constexpr double kMetalMove_s = 0.17;
constexpr double kMetalTimesRelative = 0.02;

/// Of a person who is asked to change the target.
constexpr double kPersonChanges_s = 60.0;

acquisition::ExpectedLight light_of(const RigFile& file) {
  const sim::CameraOptions& camera = file.world.camera;
  constexpr double kSquareMillimetres = 1e6;  // per square metre: C is for lengths in mm
  acquisition::ExpectedLight light;
  double scale = camera.dn_per_electron * camera.responsivity_e_per_s * kSquareMillimetres;
  if (file.rig.collimated_lamp) scale /= file.lamp_distance_mm * file.lamp_distance_mm;
  for (const sim::LampChannelOptions& channel : file.world.lamp.channels) {
    light.channels.push_back({channel.name, scale * channel.intensity_w_per_sr});
  }
  const bool own_world = file.driver == RigFile::Driver::simulated && !file.hidden;
  light.sigma_ln = own_world ? kLightOfOwnWorld : kLightUnknown;
  return light;
}

acquisition::ExpectedSample sample_of(const SessionSetup& session) {
  acquisition::ExpectedSample sample;
  // In a world in this process it is known what lies there.
  const bool named = session.expected.model != nullptr;
  const std::shared_ptr<const brdf::BrdfModel> model =
      named || !session.simulated ? session.expected.model : session.material.model;
  if (model) {
    const bool merl = session.expected.scale == brdf::RadiometricScale::merl && !session.simulated;
    const double to_si = merl ? brdf::kMerlToSi : 1.0;
    sample.brdf = [model, to_si](std::size_t, const brdf::DirectionPair& pair) -> brdf::Rgb {
      return to_si * model->evaluate(pair);
    };
    sample.point_sigma_ln = kNamedPoint;
    sample.source = named ? session.expected_name : session.material_name;
  } else if (session.exposures_us.size() == session.plan.points.size() &&
             !session.exposures_us.empty()) {
    const RigFile& rig = session.rig;
    sample.brdf = [&session, &rig](std::size_t point,
                                   const brdf::DirectionPair& pair) -> brdf::Rgb {
      // Of points that a closed loop adds later the plan knows nothing.
      if (point >= session.exposures_us.size()) {
        return brdf::Rgb::Constant(kUnknownAlbedo / std::numbers::pi);
      }
      return brdf::Rgb::Constant(radiance_of_exposure(rig, session.exposures_us[point]) /
                                 pair.wi.z());
    };
    sample.sigma_ln = kAverageSample;
    sample.point_sigma_ln = kAveragePoint;
    sample.source = "the plan's average material";
  } else {
    sample.brdf = [](std::size_t, const brdf::DirectionPair&) -> brdf::Rgb {
      return brdf::Rgb::Constant(kUnknownAlbedo / std::numbers::pi);
    };
    sample.sigma_ln = kUnknownSample;
    sample.point_sigma_ln = kUnknownPoint;
    sample.source = "a grey diffuser, which nobody has said (--expect MATERIAL)";
  }
  return sample;
}

acquisition::RigTimes times_of(const SessionSetup& session) {
  const RigFile& file = session.rig;
  acquisition::RigTimes times;
  times.change_s = std::chrono::duration<double>(file.world.change_time).count();
  times.index_search_s = std::chrono::duration<double>(file.axis_errors.index_search).count();
  if (session.simulated) return times;
  if (file.session.white == acquisition::WhitePlacement::manual) {
    times.change_s = kPersonChanges_s;
  }
  times.frame_s = kMetalFrame_s;
  times.move_s = kMetalMove_s;
  times.sigma_relative = kMetalTimesRelative;
  return times;
}

Check calibration_check(const SessionSetup& session) {
  if (!session.calibration) {
    return {"calibration", CheckResult::note,
            session.instrument.id + ": constants without an age or an origin"};
  }
  const std::vector<std::string> reasons = session.calibration->reasons();
  const std::string against = fmt::format("{}", fmt::join(reasons, "; "));
  if (reasons.empty()) return {"calibration", CheckResult::pass, session.calibration->text()};
  return {"calibration", session.accept_calibration ? CheckResult::note : CheckResult::refuse,
          "calibration: " + against};
}

Check alignment_check(const SessionSetup& session) {
  if (!session.alignment_refusal.empty()) {
    return {"alignment", CheckResult::refuse, session.alignment_refusal};
  }
  const auto value = [&](const char* key) {
    const auto found = session.alignment.find(key);
    return found == session.alignment.end() ? std::string() : found->second;
  };
  const std::string despite = value("alignment_accepted_despite");
  if (!despite.empty()) return {"alignment", CheckResult::note, "accepted despite: " + despite};
  if (value("alignment").empty() || value("alignment").starts_with("none")) {
    return {"alignment", CheckResult::note,
            fmt::format("nobody has looked how the sample lies: its normal counts as known to "
                        "{:.3f} deg",
                        session.instrument.u_normal.degrees())};
  }
  return {"alignment", CheckResult::pass,
          fmt::format("by {}, found {}", value("alignment"), value("alignment_found_utc"))};
}

Check reach_check(const SessionSetup& session) {
  const std::size_t skipped = session.skipped.size();
  const std::size_t all = skipped + session.plan.points.size();
  if (skipped == 0) {
    return {"reach", CheckResult::pass, fmt::format("all {} directions have a pose", all)};
  }
  const acquisition::RefusedDirection& first = session.skipped.front();
  const std::string text = fmt::format(
      "{} of {} directions cannot be measured, the first {}: {}: {}", skipped, all,
      to_text(first.direction.angles), rig::to_string(first.refusal.reason), first.refusal.detail);
  if (session.skip_unreachable) return {"reach", CheckResult::note, text + "; left out"};
  return {"reach", CheckResult::refuse, text + "; --skip-unreachable leaves them out"};
}

/// Poses of the plan as they stand: a bound for every other order of them.
double lower_bound(const SessionSetup& session, double travel_s) {
  if (session.plan.lower_bound_s > 0.0) return session.plan.lower_bound_s;
  const rig::TravelModel travel(session.instrument.rig);
  std::vector<rig::TourStop> stops;
  for (const acquisition::PlannedPoint& point : session.plan.points) {
    stops.push_back({{point.pose}, 0.0});
  }
  const rig::Joints ends = acquisition::tour_ends(session.instrument.rig);
  return rig::travel_lower_bound(travel, ends, stops, travel_s, ends);
}

/// From the opening white over the points to the closing one, without the ways to checks.
double points_travel_s(const rig::RigDescription& rig, const acquisition::Itinerary& itinerary) {
  const rig::TravelModel travel(rig);
  double sum_s = 0.0;
  const acquisition::PlannedVisit* before = nullptr;
  for (const acquisition::PlannedVisit& visit : itinerary.visits) {
    const bool white = visit.kind == acquisition::VisitKind::white;
    if (!visit.point && !white) continue;
    if (before) sum_s += travel.seconds(before->pose.joints, visit.pose.joints);
    before = &visit;
  }
  return sum_s;
}

Check order_check(const SessionPreflight& preflight) {
  const double more = preflight.points_travel_s - preflight.lower_bound_s;
  constexpr double kWorthSaying = 0.05;
  const bool much = more > kWorthSaying * preflight.points_travel_s && more > 1.0;
  return {
      "order", much ? CheckResult::note : CheckResult::pass,
      fmt::format(
          "{:.1f} s of travel from the white over the points and back, no order takes less than "
          "{:.1f} s{}",
          preflight.points_travel_s, preflight.lower_bound_s,
          much ? "; gonio plan orders them" : "")};
}

}  // namespace

acquisition::Expectation expectation_of(const SessionSetup& session) {
  return {light_of(session.rig), sample_of(session), times_of(session)};
}

SessionPreflight preflight_session(const acquisition::DeviceSet& devices,
                                   const SessionSetup& session, std::size_t points_done) {
  SessionPreflight result;
  std::vector<Check> before{calibration_check(session), alignment_check(session),
                            reach_check(session)};
  const acquisition::Expectation expectation = expectation_of(session);
  result.found = acquisition::preflight(devices, session.instrument, session.plan,
                                        session.rig.session, &expectation);
  std::vector<Check>& checks = result.found.checks;
  if (session.loop) before.push_back(loop_check(*session.loop));
  checks.insert(checks.begin(), before.begin(), before.end());
  if (result.found.itinerary) {
    result.points_travel_s = points_travel_s(session.instrument.rig, *result.found.itinerary);
    result.lower_bound_s = lower_bound(session, result.points_travel_s);
    checks.push_back(order_check(result));
  }
  if (result.found.forecast) {
    const acquisition::Forecast& forecast = *result.found.forecast;
    // Darks, whites and checks of the rest are new ones.
    const double done = static_cast<double>(points_done) /
                        static_cast<double>(std::max<std::size_t>(session.plan.points.size(), 1));
    int of_points = 0;
    for (const acquisition::ForecastPoint& point : forecast.points) of_points += point.frames;
    const auto saved = static_cast<int>(done * of_points);
    result.disk = acquisition::disk_use(devices.camera->info(), forecast.frames - saved,
                                        forecast.frames_high - saved,
                                        session.archive.empty() ? "." : session.archive);
    checks.push_back(acquisition::check_disk(*result.disk, session.archive));
    checks.push_back({"duration", CheckResult::pass, "about " + to_text(forecast.total_s)});
  }
  return result;
}

SessionPreflight preflight_session(const SessionSetup& session) {
  // A plan does not know what it will lie on; only what the devices are is looked at.
  const std::shared_ptr<const brdf::BrdfModel> sample =
      session.material.model
          ? session.material.model
          : std::make_shared<brdf::Lambertian>(brdf::Rgb::Constant(kUnknownAlbedo));
  sim::SimOptions world = simulated_world(session.rig, sample, session.seed);
  if (!session.simulated) {
    // The session is foreseen with the checks that the rig's own drives allow.
    world.axes.resize(world.rig.axes.size());
    for (std::size_t i = 0; i < world.axes.size(); ++i) {
      world.axes[i].tells_home_delta = session.rig.devices.axes.at(i).counts_until_homed;
    }
  }
  const auto rig = open_simulated_rig(std::move(world));
  return preflight_session(rig->devices(), session);
}

std::string to_text(const acquisition::Estimate& duration) {
  return fmt::format("{}, 90 % within {} to {}", duration_text(duration.expected),
                     duration_text(duration.low), duration_text(duration.high));
}

void use_forecast(const acquisition::Forecast& forecast, acquisition::MeasurementPlan& plan) {
  for (std::size_t i = 0; i < plan.points.size() && i < forecast.points.size(); ++i) {
    const acquisition::ForecastPoint& point = forecast.points[i];
    plan.points[i].travel_s = point.travel_s;
    plan.points[i].predicted_s = point.travel_s + point.measuring_s.expected;
  }
  plan.duration_s = forecast.total_s.expected;
}

}  // namespace gonio::cli
