#include "gonio/acquisition/itinerary.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

namespace gonio::acquisition {
namespace {

std::string_view noun(VisitKind kind) {
  return kind == VisitKind::park ? std::string_view("home") : to_string(kind);
}

}  // namespace

std::string_view to_string(VisitKind kind) {
  switch (kind) {
    case VisitKind::home:
      return "home";
    case VisitKind::dark:
      return "dark";
    case VisitKind::white:
      return "white";
    case VisitKind::point:
      return "point";
    case VisitKind::sentinel:
      return "sentinel";
    case VisitKind::park:
      return "park";
  }
  return "";
}

Itinerary session_itinerary(const rig::TravelModel& travel, const MeasurementPlan& plan,
                            const rig::Joints& white) {
  Itinerary itinerary;
  const rig::PoseSolution home{travel.rig().home()};
  const rig::PoseSolution at_white{white};
  itinerary.visits.push_back({VisitKind::home, std::nullopt, home, {}, 0.0, 0.0});
  itinerary.visits.push_back({VisitKind::dark, std::nullopt, home, {}, 0.0, 0.0});
  itinerary.visits.push_back({VisitKind::white, std::nullopt, at_white, {}, 0.0, 0.0});
  for (std::size_t i = 0; i < plan.points.size(); ++i) {
    const PlannedPoint& point = plan.points[i];
    itinerary.visits.push_back(
        {VisitKind::point, i, point.pose, {}, 0.0, point.predicted_s - point.travel_s});
  }
  itinerary.visits.push_back({VisitKind::white, std::nullopt, at_white, {}, 0.0, 0.0});
  itinerary.visits.push_back({VisitKind::park, std::nullopt, home, {}, 0.0, 0.0});
  constexpr std::size_t kFirstMove = 2;  // homing and darks are no way to anywhere
  for (std::size_t i = kFirstMove; i < itinerary.visits.size(); ++i) {
    PlannedVisit& visit = itinerary.visits[i];
    auto route = travel.route(itinerary.visits[i - 1].pose.joints, visit.pose.joints);
    if (!route) {
      throw PreflightError(
          fmt::format("pre-run check: keep-outs bar the way to stop {} of {} of the session ({})",
                      i - 1, itinerary.visits.size() - kFirstMove, noun(visit.kind)));
    }
    visit.via = std::move(route->via);
    visit.travel_s = route->seconds;
    itinerary.travel_s += visit.travel_s;
  }
  return itinerary;
}

DriftAliasing drift_aliasing(const Itinerary& itinerary, const MeasurementPlan& plan) {
  std::vector<double> times;
  std::vector<const brdf::HalfDiff*> angles;
  double now = 0.0;
  for (const PlannedVisit& visit : itinerary.visits) {
    now += visit.travel_s;
    if (visit.kind == VisitKind::point) {
      times.push_back(now + 0.5 * visit.dwell_s);
      angles.push_back(&plan.points.at(*visit.point).direction);
    }
    now += visit.dwell_s;
  }
  DriftAliasing aliasing;
  constexpr Eigen::Index kAngles = 3;
  const auto n = static_cast<Eigen::Index>(times.size());
  if (n < kAngles + 2) return aliasing;
  Eigen::VectorXd time = Eigen::Map<const Eigen::VectorXd>(times.data(), n);
  Eigen::MatrixXd columns(n, kAngles);
  for (Eigen::Index i = 0; i < n; ++i) {
    const brdf::HalfDiff& d = *angles[static_cast<std::size_t>(i)];
    columns.row(i) << d.theta_h.radians(), d.theta_d.radians(), d.phi_d.radians();
  }
  time.array() -= time.mean();
  columns.rowwise() -= columns.colwise().mean();
  const auto correlation = [&](Eigen::Index column) {
    const double size = columns.col(column).norm() * time.norm();
    return size > 0.0 ? columns.col(column).dot(time) / size : 0.0;
  };
  aliasing.theta_h = correlation(0);
  aliasing.theta_d = correlation(1);
  aliasing.phi_d = correlation(2);
  const Eigen::VectorXd fitted = columns * columns.colPivHouseholderQr().solve(time);
  const double share = time.squaredNorm() > 0.0 ? fitted.squaredNorm() / time.squaredNorm() : 0.0;
  const auto rows = static_cast<double>(n);
  aliasing.explained = std::max(0.0, 1.0 - (1.0 - share) * (rows - 1.0) / (rows - 1.0 - kAngles));
  return aliasing;
}

}  // namespace gonio::acquisition
