#include "dry_run.h"

#include <fmt/format.h>

#include <algorithm>

#include "gonio/console/console.h"
#include "gonio/console/printable.h"
#include "planning.h"

namespace gonio::cli {
namespace {

using acquisition::ForecastPoint;
using acquisition::PlannedVisit;
using acquisition::VisitKind;
using nlohmann::ordered_json;

/// Shortest and longest exposure of a point over its channels, in seconds; 0 when none is known.
std::pair<double, double> exposures_s(const ForecastPoint& point) {
  double shortest = 0.0;
  double longest = 0.0;
  for (const acquisition::ForecastBracket& bracket : point.channels) {
    shortest = shortest == 0.0 ? bracket.shortest_s : std::min(shortest, bracket.shortest_s);
    longest = std::max(longest, bracket.longest_s);
  }
  return {shortest, longest};
}

std::string joints_text(const rig::Joints& joints) {
  std::string text;
  for (const Angle joint : joints) text += fmt::format(" {:8.2f}", joint.degrees());
  return text;
}

ordered_json joints_json(const rig::RigDescription& rig, const rig::Joints& joints) {
  ordered_json json = ordered_json::object();
  for (std::size_t k = 0; k < rig.axes.size(); ++k) {
    json[rig.axes[k].name + "_deg"] = joints[k].degrees();
  }
  return json;
}

/// What may go wrong with the exposures of a point, in words.
std::string troubles(const ForecastPoint& point) {
  std::string text;
  const auto add = [&](bool is, const char* word) {
    if (is) text += std::string(text.empty() ? "" : ", ") + word;
  };
  add(!point.in_view, "not in view");
  add(point.saturates, "saturates");
  add(point.dark, "dark");
  add(point.short_of_sigma, "imprecise");
  return text;
}

/// One line per stop.
std::string itinerary_text(const SessionSetup& session, const SessionPreflight& preflight) {
  const rig::RigDescription& rig = session.instrument.rig;
  std::string text = fmt::format("{:>5}  {:<11} {:<30} branch", "point", "stop", "direction");
  for (const rig::Axis& axis : rig.axes) text += fmt::format(" {:>8.8}", axis.name);
  text += fmt::format(" {:>4} {:>18} {:>6} {:>8} {:>8}\n", "via", "exposures [ms]", "frames", "[s]",
                      "ends [s]");
  double ends_s = 0.0;
  for (const PlannedVisit& visit : preflight.found.itinerary->visits) {
    ends_s += visit.travel_s + visit.dwell_s;
    if (!visit.point) {
      text += fmt::format("{:>5}  {:<11} {:<30} {:<6}{} {:>4}", "", to_string(visit.kind), "", "",
                          joints_text(visit.pose.joints), visit.via.size());
      if (preflight.found.forecast) {
        text += fmt::format(" {:>18} {:>6} {:>8.1f} {:>8.1f}", "", "",
                            visit.travel_s + visit.dwell_s, ends_s);
      }
      text += "\n";
      continue;
    }
    const acquisition::PlannedPoint& planned = session.plan.points[*visit.point];
    text += fmt::format("{:>5}  {:<11} {:<30} {:<6}{} {:>4}", *visit.point, to_string(visit.kind),
                        to_text(planned.direction), rig::branch_name(visit.pose),
                        joints_text(visit.pose.joints), visit.via.size());
    if (preflight.found.forecast) {
      const ForecastPoint& point = preflight.found.forecast->points[*visit.point];
      const auto [shortest, longest] = exposures_s(point);
      text += fmt::format(" {:>8.3g} to {:>6.3g} {:>6} {:>8.1f} {:>8.1f} {}", 1e3 * shortest,
                          1e3 * longest, point.frames, point.travel_s + point.measuring_s.expected,
                          point.ends_at_s, troubles(point));
    }
    text += "\n";
  }
  return text;
}

ordered_json estimate_json(const acquisition::Estimate& estimate, const std::string& name) {
  return {{name + "_s", estimate.expected},
          {name + "_low_s", estimate.low},
          {name + "_high_s", estimate.high}};
}

ordered_json visit_json(const SessionSetup& session, const SessionPreflight& preflight,
                        const PlannedVisit& visit, double ends_s) {
  const rig::RigDescription& rig = session.instrument.rig;
  ordered_json json{{"stop", to_string(visit.kind)}};
  if (visit.point) {
    const brdf::HalfDiff& direction = session.plan.points[*visit.point].direction;
    json["point"] = *visit.point;
    json["theta_h_deg"] = direction.theta_h.degrees();
    json["theta_d_deg"] = direction.theta_d.degrees();
    json["phi_d_deg"] = direction.phi_d.degrees();
    json["branch"] = rig::branch_name(visit.pose);
  }
  json.update(joints_json(rig, visit.pose.joints));
  json["via"] = ordered_json::array();
  for (const rig::Joints& stop : visit.via) json["via"].push_back(joints_json(rig, stop));
  json["travel_s"] = visit.travel_s;
  if (!preflight.found.forecast) return json;
  if (!visit.point) {
    json["predicted_s"] = visit.travel_s + visit.dwell_s;
    json["ends_at_s"] = ends_s;
    return json;
  }
  const ForecastPoint& point = preflight.found.forecast->points[*visit.point];
  const auto [shortest, longest] = exposures_s(point);
  json["shortest_exposure_us"] = 1e6 * shortest;
  json["longest_exposure_us"] = 1e6 * longest;
  json["frames"] = point.frames;
  json["predicted_s"] = point.travel_s + point.measuring_s.expected;
  json["predicted_low_s"] = point.travel_s + point.measuring_s.low;
  json["predicted_high_s"] = point.travel_s + point.measuring_s.high;
  json["ends_at_s"] = point.ends_at_s;
  json["in_view"] = point.in_view;
  json["saturates"] = point.saturates;
  json["dark"] = point.dark;
  json["short_of_sigma"] = point.short_of_sigma;
  return json;
}

}  // namespace

std::string dry_run_text(const SessionSetup& session, const SessionPreflight& preflight) {
  std::string text;
  const acquisition::Preflight& found = preflight.found;
  if (found.itinerary) {
    text += itinerary_text(session, preflight) + "\n";
    for (const acquisition::AxisUse& axis : found.axes) {
      text += fmt::format("axis {:<12} {:8.2f} to {:8.2f} deg, {:8.1f} deg in {} moves\n",
                          axis.name, axis.lowest.degrees(), axis.highest.degrees(),
                          axis.travelled.degrees(), axis.moves);
    }
    text += "\n";
  }
  if (found.forecast) {
    const auto line = [&](const std::string& name, const acquisition::Estimate& seconds) {
      text += fmt::format("{:<17} {:8.1f} s  ({:.1f} to {:.1f})\n", name, seconds.expected,
                          seconds.low, seconds.high);
    };
    for (const auto& part : found.forecast->parts) line(part.name, part.seconds);
    line("whole session", found.forecast->total_s);
    text += fmt::format("{:<17} {:8} ({} at most)\n\n", "frames", found.forecast->frames,
                        found.forecast->frames_high);
  }
  for (const acquisition::Check& check : found.checks) {
    text += fmt::format("{:<7} {:<12} {}\n", to_string(check.result), check.name,
                        printable_line(check.text));
  }
  for (const acquisition::RefusedDirection& skipped : session.skipped) {
    text +=
        fmt::format("{:<7} {:<32} {}: {}\n", "skipped", to_text(skipped.direction.angles),
                    rig::to_string(skipped.refusal.reason), printable_line(skipped.refusal.detail));
  }
  return text;
}

ordered_json dry_run_json(const SessionSetup& session, const SessionPreflight& preflight) {
  const acquisition::Preflight& found = preflight.found;
  ordered_json json{{"rig", session.instrument.rig.name},
                    {"refused", found.refusal() != nullptr},
                    {"points", session.plan.points.size()}};
  json["checks"] = ordered_json::array();
  for (const acquisition::Check& check : found.checks) {
    json["checks"].push_back(
        {{"name", check.name}, {"result", to_string(check.result)}, {"text", check.text}});
  }
  json["skipped"] = ordered_json::array();
  for (const acquisition::RefusedDirection& skipped : session.skipped) {
    json["skipped"].push_back({{"line", skipped.direction.line},
                               {"theta_h_deg", skipped.direction.angles.theta_h.degrees()},
                               {"theta_d_deg", skipped.direction.angles.theta_d.degrees()},
                               {"phi_d_deg", skipped.direction.angles.phi_d.degrees()},
                               {"reason", rig::to_string(skipped.refusal.reason)},
                               {"detail", skipped.refusal.detail}});
  }
  if (found.forecast) {
    const acquisition::Forecast& forecast = *found.forecast;
    json.update(estimate_json(forecast.total_s, "duration"));
    json["parts"] = ordered_json::array();
    for (const auto& part : forecast.parts) {
      ordered_json each{{"part", part.name}};
      each.update(estimate_json(part.seconds, "duration"));
      json["parts"].push_back(each);
    }
    json["frames"] = forecast.frames;
    json["frames_high"] = forecast.frames_high;
  }
  if (preflight.disk) {
    json["disk_needed_bytes"] = preflight.disk->needed_bytes;
    json["disk_needed_high_bytes"] = preflight.disk->needed_high_bytes;
    json["disk_free_bytes"] = preflight.disk->free_bytes;
  }
  if (!found.itinerary) return json;
  json["travel_s"] = found.itinerary->travel_s;
  json["points_travel_s"] = preflight.points_travel_s;
  json["points_travel_at_least_s"] = preflight.lower_bound_s;
  json["time_theta_h_correlation"] = found.drift.theta_h;
  json["time_theta_d_correlation"] = found.drift.theta_d;
  json["time_phi_d_correlation"] = found.drift.phi_d;
  json["time_explained_by_angles"] = found.drift.explained;
  json["axes"] = ordered_json::array();
  for (const acquisition::AxisUse& axis : found.axes) {
    json["axes"].push_back({{"axis", axis.name},
                            {"lowest_deg", axis.lowest.degrees()},
                            {"highest_deg", axis.highest.degrees()},
                            {"travelled_deg", axis.travelled.degrees()},
                            {"moves", axis.moves}});
  }
  json["stops"] = ordered_json::array();
  double ends_s = 0.0;
  for (const PlannedVisit& visit : found.itinerary->visits) {
    ends_s += visit.travel_s + visit.dwell_s;
    json["stops"].push_back(visit_json(session, preflight, visit, ends_s));
  }
  return json;
}

}  // namespace gonio::cli
