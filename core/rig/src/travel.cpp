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

namespace {

double straight_seconds(const Axis& axis, Angle distance) {
  return rest_to_rest_seconds(distance.degrees(), axis.max_speed_deg_per_s,
                              axis.acceleration_deg_per_s2);
}

}  // namespace

TravelModel::TravelModel(const RigDescription& rig) : rig_(rig) { rig_.validate(); }

double TravelModel::axis_seconds(std::size_t axis, Angle from, Angle to) const {
  const Axis& a = rig_.axes[axis];
  const Angle past = overshoot(a, from, to);
  return straight_seconds(a, to - past - from) + straight_seconds(a, past);
}

double TravelModel::seconds(const Joints& from, const Joints& to) const {
  if (from.size() != rig_.axes.size() || to.size() != rig_.axes.size()) {
    throw std::invalid_argument("TravelModel: expected " + std::to_string(rig_.axes.size()) +
                                " joint angles");
  }
  double there = 0.0;  // to the targets, or past them
  double back = 0.0;   // from past them
  double sum = 0.0;
  for (std::size_t k = 0; k < rig_.axes.size(); ++k) {
    if (from[k] == to[k]) continue;
    const double settle = std::chrono::duration<double>(rig_.axes[k].settle).count();
    const Angle past = overshoot(rig_.axes[k], from[k], to[k]);
    const double first = straight_seconds(rig_.axes[k], to[k] - past - from[k]) + settle;
    const double second = past > Angle() ? straight_seconds(rig_.axes[k], past) + settle : 0.0;
    there = std::max(there, first);
    back = std::max(back, second);
    sum += first + second;
  }
  return rig_.simultaneous_axes ? there + back : sum;
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
