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

  PeriodicCheck sentinel_at(std::size_t point) const {
    PeriodicCheck check;
    check.stops = {{VisitKind::sentinel, std::nullopt, plan_.points[point].pose, {}, 0.0, 0.0}};
    return check;
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
  PeriodicCheck check = sentinel_at(4);
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
    const rig::Joints& by = check.stops.front().pose.joints;
    detours.push_back(travel_.seconds(from, by) + travel_.seconds(by, to) -
                      travel_.seconds(from, to));
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
  PeriodicCheck check = sentinel_at(0);
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
  check.stops = {{VisitKind::white, std::nullopt, {white_joints(rig_)}, {}, 0.0, 45.0}};
  check.every_points = 6;
  const Itinerary with = with_periodic_check(travel_, itinerary_, check);
  EXPECT_EQ(count(with, VisitKind::white), 3) << "opening, one between, closing";
  check.every_points = 0;
  EXPECT_THROW(with_periodic_check(travel_, itinerary_, check), std::invalid_argument);
}

TEST_F(ItineraryOf, GoesToAllStopsOfACheckAndChoosesByAllTheirWays) {
  plan_of(12, 2);
  PeriodicCheck check = sentinel_at(4);
  check.stops.insert(check.stops.begin(),
                     {VisitKind::home, std::nullopt, {rig_.home()}, {}, 0.0, 1.0});
  check.every_points = 6;
  const Itinerary with = with_periodic_check(travel_, itinerary_, check);
  expect_consistent(with);
  EXPECT_EQ(count(with, VisitKind::sentinel), 1);
  EXPECT_EQ(count(with, VisitKind::home), 2) << "at the start, and with the sentinel";
  // Six points before and six after are the only place.
  EXPECT_EQ(with.visits[3 + 6].kind, VisitKind::home);
  EXPECT_EQ(with.visits[3 + 7].kind, VisitKind::sentinel);
}

TEST_F(ItineraryOf, ASessionChecksAtItsEndsAndWhereItCostsLeastBetweenThem) {
  plan_of(50, 7);
  SessionOptions options;
  options.sentinel_every = 20;
  options.white_interval = std::chrono::seconds(120);
  const SessionChecks checks = SessionChecks::of(plan_, options, true);
  EXPECT_TRUE(checks.home && checks.sentinel && checks.white);
  const Itinerary with = with_session_checks(travel_, itinerary_, options, checks);
  expect_consistent(with);
  EXPECT_EQ(with.visits[3].kind, VisitKind::sentinel) << "behind the opening white";
  const std::vector<VisitKind> all = kinds(with);
  EXPECT_THAT(std::vector(all.end() - 4, all.end()),
              ElementsAre(VisitKind::home, VisitKind::sentinel, VisitKind::white, VisitKind::park));
  EXPECT_EQ(count(with, VisitKind::sentinel), 4) << "first, two between, last";
  EXPECT_EQ(count(with, VisitKind::home), 4);
  EXPECT_GE(count(with, VisitKind::white), 3);
  // Not dearer than after every 20 points, as if the way did not matter.
  double rigid_s = 0.0;
  for (const std::size_t place : {19U, 39U}) {
    const rig::Joints& from = plan_.points[place].pose.joints;
    const rig::Joints& to = plan_.points[place + 1].pose.joints;
    rigid_s += travel_.seconds(from, rig_.home()) +
               travel_.seconds(rig_.home(), white_joints(rig_)) +
               travel_.seconds(white_joints(rig_), to) - travel_.seconds(from, to);
  }
  options.white_interval = {};
  const SessionChecks no_whites = SessionChecks::of(plan_, options, true);
  EXPECT_FALSE(no_whites.white);
  const double cheapest_s = with_session_checks(travel_, itinerary_, options, no_whites).travel_s;
  options.sentinel_every = 50;  // at the ends alone
  SessionChecks ends = no_whites;
  const double ends_s = with_session_checks(travel_, itinerary_, options, ends).travel_s;
  EXPECT_LT(cheapest_s - ends_s, rigid_s);
}

TEST_F(ItineraryOf, SpreadsRepeatPairsOverTheSession) {
  plan_of(40, 4);
  PairOptions options;
  options.repeats = 4;
  const MeasurementPlan with = with_pairs(inverse_, plan_, options);
  ASSERT_EQ(with.points.size(), 44U);
  std::vector<const PlannedPoint*> firsts;
  std::vector<int> quarters(4, 0);
  for (const PlannedPoint& point : with.points) {
    if (!point.again) {
      firsts.push_back(&point);
      continue;
    }
    const auto first = std::find_if(firsts.begin(), firsts.end(), [&](const PlannedPoint* each) {
      return each->pose.joints == point.pose.joints;
    });
    ASSERT_NE(first, firsts.end());
    const std::ptrdiff_t order = first - firsts.begin();
    EXPECT_GE(static_cast<std::ptrdiff_t>(firsts.size()), order + 20)
        << "half of the session apart";
    ++quarters.at(static_cast<std::size_t>(order) / 5);
  }
  EXPECT_THAT(quarters, ElementsAre(1, 1, 1, 1)) << "of the first half";
  const Itinerary tour = session_itinerary(travel_, with, white_joints(rig_));
  expect_consistent(tour);
  EXPECT_NEAR(with.travel_s - plan_.travel_s, tour.travel_s - itinerary_.travel_s, 1e-6);
  double points_s = 0.0;
  for (const PlannedPoint& point : with.points) points_s += point.predicted_s;
  EXPECT_NEAR(with.duration_s, points_s, 1e-6);
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
  EXPECT_LT((tour.travel_s - itinerary_.travel_s) / 4.0, 0.6 * sum / places);
}

TEST_F(ItineraryOf, MeasuresReciprocalPairsWithLightAndCameraExchanged) {
  plan_of(40, 5);
  PairOptions options;
  options.reciprocals = 3;
  const MeasurementPlan with = with_pairs(inverse_, plan_, options);
  EXPECT_GE(with.points.size(), 41U);
  EXPECT_LE(with.points.size(), 43U);
  for (const PlannedPoint& point : with.points) {
    if (!point.again) continue;
    const auto first =
        std::find_if(plan_.points.begin(), plan_.points.end(), [&](const PlannedPoint& each) {
          return each.direction.theta_h == point.direction.theta_h &&
                 each.direction.phi_d == point.direction.phi_d;
        });
    ASSERT_NE(first, plan_.points.end());
    const auto directions = [&](const rig::PoseSolution& pose) {
      return rig::forward(rig_, pose.joints).directions_at(Eigen::Vector3d::Zero());
    };
    const brdf::DirectionPair before = directions(first->pose);
    const brdf::DirectionPair after = directions(point.pose);
    EXPECT_NEAR(before.wi.z(), after.wo.z(), 1e-9);
    EXPECT_NEAR(before.wo.z(), after.wi.z(), 1e-9);
    EXPECT_NEAR(before.wi.dot(before.wo), after.wi.dot(after.wo), 1e-9);
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
