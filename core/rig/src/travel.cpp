#include "gonio/rig/travel.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "gonio/rig/paths.h"

namespace gonio::rig {

double rest_to_rest_seconds(double distance, double max_speed, double acceleration) {
  const double d = std::abs(distance);
  const bool reaches_full_speed = d > max_speed * max_speed / acceleration;
  return reaches_full_speed ? d / max_speed + max_speed / acceleration
                            : 2.0 * std::sqrt(d / acceleration);
}

TravelModel::TravelModel(const RigDescription& rig) : rig_(rig) { rig_.validate(); }

double TravelModel::axis_seconds(std::size_t axis, Angle from, Angle to) const {
  const Axis& a = rig_.axes[axis];
  const Angle past = overshoot(a, from, to);
  const auto seconds = [&](Angle distance) {
    return rest_to_rest_seconds(distance.degrees(), a.max_speed_deg_per_s,
                                a.acceleration_deg_per_s2);
  };
  return past == Angle() ? seconds(to - from) : seconds(from - to + past) + seconds(past);
}

double TravelModel::seconds(const Joints& from, const Joints& to) const {
  if (from.size() != rig_.axes.size() || to.size() != rig_.axes.size()) {
    throw std::invalid_argument("TravelModel: expected " + std::to_string(rig_.axes.size()) +
                                " joint angles");
  }
  double longest = 0.0;
  double sum = 0.0;
  for (std::size_t k = 0; k < rig_.axes.size(); ++k) {
    if (from[k] == to[k]) continue;
    const double settle = std::chrono::duration<double>(rig_.axes[k].settle).count();
    const double axis = axis_seconds(k, from[k], to[k]) + settle;
    longest = std::max(longest, axis);
    sum += axis;
  }
  return rig_.simultaneous_axes ? longest : sum;
}

std::optional<TravelModel::Route> TravelModel::route(const Joints& from, const Joints& to,
                                                     Angle margin) const {
  if (rig_.keep_outs.empty()) return Route{{}, seconds(from, to)};
  auto stops = way_around(rig_, from, to, margin);
  if (!stops) return std::nullopt;
  Route route{std::move(*stops), 0.0};
  const Joints* at = &from;
  for (const Joints& stop : route.via) {
    route.seconds += seconds(*at, stop);
    at = &stop;
  }
  route.seconds += seconds(*at, to);
  return route;
}

}  // namespace gonio::rig
