#include "gonio/acquisition/forecast.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "gonio/parallel/parallel.h"
#include "visit_forecaster.h"

namespace gonio::acquisition {
namespace {

constexpr std::size_t kPointsPerTask = 4;

Estimate estimate(const Uncertain& uncertain) {
  const double own = kNinetyPercent * std::sqrt(uncertain.variance);
  return {uncertain.seconds,
          std::max(0.0, uncertain.seconds - std::hypot(uncertain.seconds - uncertain.low, own)),
          uncertain.seconds + std::hypot(uncertain.high - uncertain.seconds, own)};
}

void add(Uncertain& sum, const Uncertain& each) {
  sum.seconds += each.seconds;
  sum.low += each.low;
  sum.high += each.high;
  sum.variance += each.variance;
}

}  // namespace

Forecast forecast_session(const instrument::Instrument& instrument, const Itinerary& itinerary,
                          const MeasurementPlan& plan, const SessionOptions& options,
                          const devices::CameraInfo& camera, const ExpectedLight& light,
                          const ExpectedSample& sample, const RigTimes& times) {
  if (light.channels.empty())
    throw std::invalid_argument("forecast_session: a light without channels");
  const VisitForecaster forecaster(instrument, options, camera, light, times);
  std::vector<VisitForecaster::Point> points(plan.points.size());
  parallel::for_each_block(0, points.size(), kPointsPerTask,
                           [&](std::size_t begin, std::size_t end) {
                             for (std::size_t i = begin; i < end; ++i)
                               points[i] = forecaster.point(i, plan.points[i], sample);
                           });

  Forecast forecast;
  Uncertain home;
  Uncertain dark;
  Uncertain opening;
  Uncertain closing;
  Uncertain travel;
  Uncertain measuring;
  Uncertain park;
  Uncertain checks;
  double now = 0.0;
  bool measured_some = false;
  const auto last_white =
      std::find_if(itinerary.visits.rbegin(), itinerary.visits.rend(),
                   [](const auto& each) { return each.kind == VisitKind::white; });
  for (const PlannedVisit& visit : itinerary.visits) {
    const Uncertain way = forecaster.travel(visit);
    Uncertain stay;
    switch (visit.kind) {
      case VisitKind::home:
        stay = measured_some ? forecaster.home_check() : forecaster.homing();
        add(measured_some ? checks : home, stay);
        break;
      case VisitKind::sentinel: {
        const VisitForecaster::Target sentinel =
            forecaster.sentinel(visit.pose.joints, sample, !measured_some);
        stay = sentinel.seconds;
        forecast.frames += sentinel.frames;
        forecast.frames_high += sentinel.frames_high;
        add(measured_some ? checks : opening, stay);
        break;
      }
      case VisitKind::dark:
        stay = forecaster.darks();
        add(dark, stay);
        forecast.frames += options.dark_frames;
        forecast.frames_high += options.dark_frames;
        break;
      case VisitKind::white: {
        const VisitForecaster::Target white = forecaster.white(visit.pose.joints);
        stay = white.seconds;
        forecast.frames += white.frames;
        forecast.frames_high += white.frames_high;
        const bool last = &visit == &*last_white;
        add(last ? closing : measured_some ? checks : opening, stay);
        if (measured_some && !last) {  // with darks of its own
          add(checks, forecaster.darks());
          stay.seconds += forecaster.darks().seconds;
          forecast.frames += options.dark_frames;
          forecast.frames_high += options.dark_frames;
        }
        break;
      }
      case VisitKind::park:
        break;
      case VisitKind::point: {
        measured_some = true;
        const VisitForecaster::Point& point = points[*visit.point];
        stay = point.measuring;
        forecast.frames += point.point.frames;
        forecast.frames_high += point.frames_high;
        add(measuring, stay);
      }
    }
    add(visit.kind == VisitKind::park ? park : travel, way);
    now += way.seconds + stay.seconds;
    forecast.dwells_s.push_back(way.seconds + stay.seconds - visit.travel_s);
    if (visit.kind == VisitKind::point) {
      ForecastPoint& point = points[*visit.point].point;
      point.travel_s = way.seconds;
      point.ends_at_s = now;
    }
  }
  forecast.parts = {{"home", estimate(home)},
                    {"dark", estimate(dark)},
                    {"white", estimate(opening)},
                    {"travel", estimate(travel)},
                    {"points", estimate(measuring)},
                    {"checks", estimate(checks)},
                    {"closing white", estimate(closing)},
                    {"park", estimate(park)}};
  // Light and material move points and whites together; a slow rig is another matter.
  Uncertain exposures = measuring;
  add(exposures, opening);
  add(exposures, closing);
  add(exposures, checks);
  Uncertain rest = home;
  add(rest, dark);
  Uncertain ways = travel;
  add(ways, park);
  Uncertain whole = rest;
  add(whole, exposures);
  add(whole, ways);
  const auto together = [&](double light_s, double way_s) {
    return std::sqrt(light_s * light_s + way_s * way_s +
                     kNinetyPercent * kNinetyPercent * whole.variance);
  };
  forecast.total_s.expected = whole.seconds;
  forecast.total_s.low = std::max(
      0.0, whole.seconds - together(exposures.seconds - exposures.low, ways.seconds - ways.low));
  forecast.total_s.high =
      whole.seconds + together(exposures.high - exposures.seconds, ways.high - ways.seconds);
  for (VisitForecaster::Point& each : points) forecast.points.push_back(std::move(each.point));
  return forecast;
}

}  // namespace gonio::acquisition
