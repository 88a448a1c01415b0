#include "gonio/acquisition/itinerary.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <vector>

#include "directions_deg.h"
#include "gonio/random/distributions.h"

namespace gonio::acquisition {
namespace {

using testing::ElementsAre;

constexpr double kRounding_s = 1e-9;

std::vector<VisitKind> kinds(const Itinerary& itinerary) {
  std::vector<VisitKind> all;
  for (const PlannedVisit& visit : itinerary.visits) all.push_back(visit.kind);
  return all;
}

int count(const Itinerary& itinerary, VisitKind kind) {
  const std::vector<VisitKind> all = kinds(itinerary);
  return static_cast<int>(std::count(all.begin(), all.end(), kind));
}

class ItineraryOf : public testing::Test {
 protected:
  /// Reachable directions anywhere, in the best order.
  void plan_of(int points, std::uint64_t seed) {
    const random::Key key = random::make_key(seed, "itinerary.directions");
    std::vector<samples::Direction> directions;
    for (std::uint64_t i = 0; static_cast<int>(directions.size()) < points; i += 3) {
      samples::Direction direction;
      direction.angles =
          half_diff_deg(60.0 * random::uniform(key, i), 4.0 + 70.0 * random::uniform(key, i + 1),
                        180.0 * random::uniform(key, i + 2));
      if (!inverse_.solve(direction.angles).poses.empty()) directions.push_back(direction);
    }
    plan_ = make_plan(inverse_, directions, kDwell_s, 0.0, seed);
    itinerary_ = session_itinerary(travel_, plan_, white_joints(rig_));
  }

  /// Every way is that of the travel model, and the sum is the sum.
  void expect_consistent(const Itinerary& itinerary) const {
    double sum = 0.0;
    for (std::size_t i = 2; i < itinerary.visits.size(); ++i) {
      const PlannedVisit& visit = itinerary.visits[i];
      EXPECT_NEAR(visit.travel_s,
                  travel_.seconds(itinerary.visits[i - 1].pose.joints, visit.pose.joints),
                  kRounding_s);
      sum += visit.travel_s;
    }
    EXPECT_NEAR(itinerary.travel_s, sum, kRounding_s);
  }

  static constexpr double kDwell_s = 2.0;
  rig::RigDescription rig_ = rig::la2();
  rig::TravelModel travel_{rig_};
  rig::Inverse inverse_{rig_};
  MeasurementPlan plan_;
  Itinerary itinerary_;
};

TEST_F(ItineraryOf, IsWhatASessionDoes) {
  plan_of(2, 1);
  EXPECT_THAT(kinds(itinerary_),
              ElementsAre(VisitKind::home, VisitKind::dark, VisitKind::white, VisitKind::point,
                          VisitKind::point, VisitKind::white, VisitKind::park));
  EXPECT_EQ(itinerary_.visits[3].point, 0U);
  EXPECT_EQ(itinerary_.visits[4].point, 1U);
  EXPECT_EQ(itinerary_.visits[6].pose.joints, rig_.home());
  EXPECT_DOUBLE_EQ(itinerary_.visits[3].dwell_s, kDwell_s);
  expect_consistent(itinerary_);
  // What the tour was chosen by, and the ways from and to home.
  const double to_white_s = travel_.seconds(rig_.home(), white_joints(rig_));
  const double park_s = travel_.seconds(white_joints(rig_), rig_.home());
  EXPECT_NEAR(itinerary_.travel_s, plan_.travel_s + to_white_s + park_s, kRounding_s);
}

TEST_F(ItineraryOf, NamesTheStopThatKeepOutsBar) {
  plan_of(2, 1);
  rig_.keep_outs.push_back({"wall",
                            {{1, plan_.points[1].pose.joints[1] - Angle::from_degrees(0.5),
                              plan_.points[1].pose.joints[1] + Angle::from_degrees(0.5)}}});
  try {
    session_itinerary(rig::TravelModel(rig_), plan_, white_joints(rig::la2()));
    FAIL() << "the point lies in the keep-out";
  } catch (const PreflightError& error) {
    EXPECT_THAT(error.what(), testing::HasSubstr("keep-outs bar the way to stop"));
  }
}

TEST_F(ItineraryOf, PutsASentinelAtMostEveryFivePointsWhereItCostsLeast) {
  plan_of(12, 2);
  PeriodicCheck check;
  check.pose = plan_.points[4].pose;
  check.every_points = 5;
  const Itinerary with = with_periodic_check(travel_, itinerary_, check);
  expect_consistent(with);
  std::size_t since = 0;
  for (const PlannedVisit& visit : with.visits) {
    if (visit.kind == VisitKind::point) ++since;
    if (visit.kind == VisitKind::sentinel) since = 0;
    EXPECT_LE(since, 5U);
  }
  // Every choice of places by brute force; bit i: behind point i.
  std::vector<double> detours;
  for (std::size_t i = 0; i + 1 < plan_.points.size(); ++i) {
    const rig::Joints& from = itinerary_.visits[3 + i].pose.joints;
    const rig::Joints& to = itinerary_.visits[4 + i].pose.joints;
    detours.push_back(travel_.seconds(from, check.pose.joints) +
                      travel_.seconds(check.pose.joints, to) - travel_.seconds(from, to));
  }
  double best = HUGE_VAL;
  for (unsigned places = 0; places < 1U << detours.size(); ++places) {
    double sum = 0.0;
    int gap = 0;
    int longest = 0;
    for (std::size_t i = 0; i < plan_.points.size(); ++i) {
      longest = std::max(longest, ++gap);
      if (i == detours.size() || (places >> i & 1U) == 0) continue;
      sum += detours[i];
      gap = 0;
    }
    if (longest <= 5) best = std::min(best, sum);
  }
  EXPECT_NEAR(with.travel_s - itinerary_.travel_s, best, 1e-6);
}

TEST_F(ItineraryOf, PutsASentinelAtMostEverySoManySeconds) {
  plan_of(30, 3);
  PeriodicCheck check;
  check.pose = plan_.points[0].pose;
  check.every_s = 20.0;
  const Itinerary with = with_periodic_check(travel_, itinerary_, check);
  EXPECT_GT(count(with, VisitKind::sentinel), 2);
  double since_s = 0.0;
  bool at_points = false;
  for (const PlannedVisit& visit : with.visits) {
    const bool is_point = visit.kind == VisitKind::point;
    at_points = at_points || is_point;
    if (!at_points) continue;
    since_s = visit.kind == VisitKind::sentinel ? 0.0 : since_s + visit.travel_s + visit.dwell_s;
    // The detour of the last check may come on top of what was planned without it.
    if (is_point) {
      EXPECT_LE(since_s, check.every_s + 10.0);
    }
  }
}

TEST_F(ItineraryOf, TakesNoMoreChecksThanItHasTo) {
  plan_of(12, 2);
  PeriodicCheck check;
  check.kind = VisitKind::white;
  check.pose = {white_joints(rig_)};
  check.dwell_s = 45.0;
  check.every_points = 6;
  const Itinerary with = with_periodic_check(travel_, itinerary_, check);
  EXPECT_EQ(count(with, VisitKind::white), 3) << "opening, one between, closing";
  check.every_points = 0;
  EXPECT_THROW(with_periodic_check(travel_, itinerary_, check), std::invalid_argument);
}

TEST_F(ItineraryOf, SpreadsRepeatPairsOverTheSession) {
  plan_of(40, 4);
  PairOptions options;
  options.repeats = 4;
  const Itinerary with = with_pairs(travel_, itinerary_, inverse_, plan_, options);
  expect_consistent(with);
  EXPECT_EQ(count(with, VisitKind::repeat), 4);
  std::map<std::size_t, std::size_t> order;  // of the first halves
  std::size_t points = 0;
  std::vector<int> quarters(4, 0);
  for (const PlannedVisit& visit : with.visits) {
    if (visit.kind == VisitKind::point) order[*visit.point] = points++;
    if (visit.kind != VisitKind::repeat) continue;
    ASSERT_TRUE(order.contains(*visit.point));
    EXPECT_GE(points, order[*visit.point] + 20) << "half of the session apart";
    EXPECT_EQ(visit.pose.joints, plan_.points[*visit.point].pose.joints);
    ++quarters[order[*visit.point] / 5];
  }
  EXPECT_THAT(quarters, ElementsAre(1, 1, 1, 1)) << "of the first half";
  // Against any point at any later place.
  double sum = 0.0;
  int places = 0;
  for (std::size_t i = 0; i < 20; ++i) {
    for (std::size_t later = i + 20; later + 1 < 40; ++later, ++places) {
      const rig::Joints& from = itinerary_.visits[3 + later].pose.joints;
      const rig::Joints& to = itinerary_.visits[4 + later].pose.joints;
      const rig::Joints& by = plan_.points[i].pose.joints;
      sum += travel_.seconds(from, by) + travel_.seconds(by, to) - travel_.seconds(from, to);
    }
  }
  EXPECT_LT((with.travel_s - itinerary_.travel_s) / 4.0, 0.6 * sum / places);
}

TEST_F(ItineraryOf, MeasuresReciprocalPairsWithLightAndCameraExchanged) {
  plan_of(40, 5);
  PairOptions options;
  options.reciprocals = 3;
  const Itinerary with = with_pairs(travel_, itinerary_, inverse_, plan_, options);
  expect_consistent(with);
  EXPECT_GE(count(with, VisitKind::reciprocity), 1);
  EXPECT_LE(count(with, VisitKind::reciprocity), 3);
  for (const PlannedVisit& visit : with.visits) {
    if (visit.kind != VisitKind::reciprocity) continue;
    const auto directions = [&](const rig::PoseSolution& pose) {
      return rig::forward(rig_, pose.joints).directions_at(Eigen::Vector3d::Zero());
    };
    const brdf::DirectionPair first = directions(plan_.points[*visit.point].pose);
    const brdf::DirectionPair second = directions(visit.pose);
    EXPECT_NEAR(first.wi.z(), second.wo.z(), 1e-9);
    EXPECT_NEAR(first.wo.z(), second.wi.z(), 1e-9);
    EXPECT_NEAR(first.wi.dot(first.wo), second.wi.dot(second.wo), 1e-9);
  }
}

TEST_F(ItineraryOf, ThereAndBackFollowsTheAnglesLessThanOneWay) {
  double there_and_back = 0.0;
  double one_way = 0.0;
  for (std::uint64_t seed = 1; seed <= 8; ++seed) {
    plan_of(30, seed);
    there_and_back += drift_aliasing(itinerary_, plan_).explained / 8.0;
    std::vector<rig::TourStop> stops;
    for (const PlannedPoint& point : plan_.points) stops.push_back({{point.pose}, 0.0});
    MeasurementPlan other;
    for (const rig::TourVisit& visit :
         rig::shortest_tour(travel_, white_joints(rig_), stops, seed).visits) {
      other.points.push_back(plan_.points[visit.stop]);
    }
    const Itinerary open = session_itinerary(travel_, other, white_joints(rig_));
    one_way += drift_aliasing(open, other).explained / 8.0;
    EXPECT_LE(itinerary_.travel_s, 1.02 * open.travel_s) << "seed " << seed;
  }
  EXPECT_LT(there_and_back, one_way);
}

TEST_F(ItineraryOf, SaysWhenTimeIsAnAngle) {
  plan_of(30, 6);
  std::sort(plan_.points.begin(), plan_.points.end(),
            [](const PlannedPoint& a, const PlannedPoint& b) {
              return a.direction.theta_h < b.direction.theta_h;
            });
  const DriftAliasing drift =
      drift_aliasing(session_itinerary(travel_, plan_, white_joints(rig_)), plan_);
  EXPECT_GT(drift.theta_h, 0.9);
  EXPECT_GT(drift.explained, 0.9);
}

}  // namespace
}  // namespace gonio::acquisition
