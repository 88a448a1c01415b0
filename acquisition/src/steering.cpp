#include "gonio/acquisition/steering.h"

#include <fmt/format.h>

#include <stdexcept>

#include "gonio/acquisition/itinerary.h"
#include "gonio/rig/travel.h"
#include "steering_checks.h"

namespace gonio::acquisition {

void add_points(const Decision& decision, MeasurementPlan& plan) {
  for (const AddedPoint& added : decision.added) {
    if (added.point != static_cast<int>(plan.points.size())) {
      throw std::invalid_argument(
          fmt::format("a decision adds point {}, expected {}", added.point, plan.points.size()));
    }
    plan.points.push_back({added.direction, added.pose, 0.0, 0.0});
  }
}

std::string why_not_behind(const rig::RigDescription& rig, const MeasurementPlan& plan,
                           const PlannedPoint& point) {
  MeasurementPlan with = plan;
  with.points.push_back(point);
  try {
    check_points(with, rig);
  } catch (const PreflightError& error) {
    return error.what();
  }
  const rig::TravelModel travel(rig);
  const rig::Joints white = white_joints(rig);
  const rig::Joints& from = plan.points.empty() ? white : plan.points.back().pose.joints;
  if (!travel.route(from, point.pose.joints)) return "keep-outs bar the way to it";
  if (!travel.route(point.pose.joints, white)) return "keep-outs bar the way from it to the white";
  return {};
}

}  // namespace gonio::acquisition
