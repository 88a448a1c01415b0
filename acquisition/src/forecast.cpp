#include "gonio/acquisition/forecast.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "bracket_rules.h"
#include "expected_regions.h"
#include "gonio/acquisition/trust_notes.h"
#include "gonio/devices/clock.h"
#include "gonio/parallel/parallel.h"

namespace gonio::acquisition {
namespace {

/// Half of a 90 % interval, in standard deviations.
constexpr double kNinetyPercent = 1.645;
/// Noise decides as brackets do. The brightest of the hundreds of pixels of a region lies so many
/// of their sigmas above the brightest place, the dimmest of nine regions about as bright reads so
/// many of its own below what is true, each with its spread (mean and standard deviation of the
/// largest of 900 and of 9 normal numbers).
constexpr double kBrightestPixel = 3.2;
constexpr double kBrightestPixelSpread = 0.35;
constexpr double kDimmestRegion = 1.5;
constexpr double kDimmestRegionSpread = 0.6;
constexpr std::size_t kPointsPerTask = 4;

/// A bracket as it would be, with what the rules found out.
struct Foreseen {
  ForecastBracket bracket;
  BracketResult found;
};

using ChannelRegions = std::vector<ExpectedRegion>;

class BracketForecaster {
 public:
  BracketForecaster(const instrument::SensorModel& sensor, const SessionOptions& options,
                    const devices::CameraInfo& camera)
      : sensor_(sensor), options_(options), camera_(camera) {}

  /// With everything `brightness` times as bright as expected, and noise larger than usual by
  /// `noise` of its spreads.
  Foreseen foresee(const ChannelRegions& regions, std::chrono::nanoseconds first_exposure,
                   double brightness, double noise = 0.0) const {
    Foreseen foreseen;
    ForecastBracket& bracket = foreseen.bracket;
    bracket.shortest_s = std::numeric_limits<double>::infinity();
    const auto expose = [&](std::chrono::nanoseconds exposure) {
      const double exposure_s = devices::to_seconds(exposure);
      bracket.shortest_s = std::min(bracket.shortest_s, exposure_s);
      bracket.longest_s = std::max(bracket.longest_s, exposure_s);
      bracket.exposed_s += exposure_s;
      ++bracket.frames;
      std::vector<RegionReading> readings;
      readings.reserve(regions.size());
      for (const ExpectedRegion& region : regions) {
        readings.push_back(
            reading(region, exposure_s + sensor_.shutter_offset_s, brightness, noise));
      }
      return readings;
    };
    foreseen.found = bracket_exposures(sensor_, options_, camera_, first_exposure, expose);
    return foreseen;
  }

 private:
  RegionReading reading(const ExpectedRegion& region, double open_s, double brightness,
                        double noise) const {
    const double k = sensor_.gain_dn_per_e;
    const double dark_dn = k * sensor_.dark_current_e_per_s * open_s;
    RegionReading reading;
    reading.pixels = region.pixels;
    const double mean_dn = region.mean_dn_per_s * brightness * open_s + dark_dn;
    const double brightest_dn = region.maximum_dn_per_s * brightness * open_s + dark_dn;
    const double read_variance = k * k * sensor_.read_noise_e * sensor_.read_noise_e;
    reading.mean_dn = mean_dn - (kDimmestRegion + noise * kDimmestRegionSpread) *
                                    std::sqrt((read_variance + k * mean_dn) / region.pixels);
    const double sigma_dn =
        std::sqrt(read_variance + k * brightest_dn + std::pow(sensor_.prnu * brightest_dn, 2));
    const double full_dn = camera_.saturation_level_dn > 0
                               ? static_cast<double>(camera_.saturation_level_dn)
                               : sensor_.saturation_dn;
    // Far above saturation the response curve, a polynomial, means nothing.
    const double above = kBrightestPixel + noise * kBrightestPixelSpread;
    const double linear_dn =
        std::min(brightest_dn + above * sigma_dn, full_dn - sensor_.black_level_dn);
    reading.maximum_dn = sensor_.black_level_dn + sensor_.response.measured_dn(linear_dn);
    if (linear_dn >= full_dn - sensor_.black_level_dn) reading.maximum_dn = full_dn;
    return reading;
  }

  const instrument::SensorModel& sensor_;
  const SessionOptions& options_;
  const devices::CameraInfo& camera_;
};

/// Time and spread about it: both add up over points, the second as squares.
struct Uncertain {
  double seconds = 0.0;
  double low = 0.0;  ///< of the common unknown
  double high = 0.0;
  double variance = 0.0;  ///< of its own
};

class SessionForecaster {
 public:
  SessionForecaster(const instrument::Instrument& instrument, const SessionOptions& options,
                    const devices::CameraInfo& camera, const ExpectedLight& light,
                    const RigTimes& times)
      : instrument_(instrument),
        options_(options),
        camera_(camera),
        light_(light),
        times_(times),
        brackets_(instrument.sensor, options, camera),
        frame_s_(devices::to_seconds(camera.readout) + times.frame_s) {}

  struct Point {
    ForecastPoint point;
    Uncertain measuring;
    int frames_high = 0;
  };

  Point point(std::size_t index, const PlannedPoint& planned, const ExpectedSample& sample) const {
    const TargetSquare square{Eigen::Vector2d::Zero(), options_.sample_half_width_mm, 3};
    const auto channels =
        expected_regions(instrument_, rig::forward(instrument_.rig, planned.pose.joints), square,
                         camera_.pixel_format, light_,
                         [&](const brdf::DirectionPair& pair) { return sample.brdf(index, pair); });
    Point result;
    result.point.in_view = !channels.front().empty();
    if (!result.point.in_view) return result;
    const double common = std::hypot(light_.sigma_ln, sample.sigma_ln);
    const auto scaled = [&](double sigmas, double sigma_ln) { return std::exp(sigmas * sigma_ln); };
    // Three nodes of a normal distribution: brackets go by steps, and their mean over many points
    // is not the bracket of the mean. Dim and noisy stand together: both ask for more.
    constexpr double kNode = 1.7320508;
    const auto seconds = [&](double node) {
      ForecastPoint other;
      return measure_point(channels, scaled(node, sample.point_sigma_ln), -node, other);
    };
    const double expected = measure_point(channels, 1.0, 0.0, result.point);
    const double dimmer = seconds(-kNode);
    const double brighter = seconds(kNode);
    const double mean = (4.0 * expected + dimmer + brighter) / 6.0;
    result.measuring.variance = (4.0 * std::pow(expected - mean, 2) + std::pow(dimmer - mean, 2) +
                                 std::pow(brighter - mean, 2)) /
                                6.0;
    ForecastPoint dim;
    ForecastPoint bright;
    const double dimmest = measure_point(channels, scaled(-kNinetyPercent, common), 0.0, dim);
    const double brightest = measure_point(channels, scaled(kNinetyPercent, common), 0.0, bright);
    result.measuring.seconds = mean;
    result.measuring.low = std::min({mean, dimmest, brightest});
    result.measuring.high = std::max({mean, dimmest, brightest});
    result.frames_high = std::max({result.point.frames, dim.frames, bright.frames});
    const double own = kNinetyPercent * std::sqrt(result.measuring.variance);
    result.point.measuring_s = {mean, mean - std::hypot(mean - result.measuring.low, own),
                                mean + std::hypot(result.measuring.high - mean, own)};
    return result;
  }

  struct White {
    Uncertain seconds;
    int frames = 0;
    int frames_high = 0;
  };

  White white(const rig::Joints& joints) const {
    const bool patch = options_.white == WhitePlacement::in_frame;
    TargetSquare square{Eigen::Vector2d::Zero(),
                        options_.white_half_width_mm.value_or(options_.sample_half_width_mm), 3};
    if (patch) square = {options_.white_patch_mm, options_.white_patch_half_width_mm, 1};
    const auto channels =
        expected_regions(instrument_, rig::forward(instrument_.rig, joints), square,
                         camera_.pixel_format, light_, [&](const brdf::DirectionPair& pair) {
                           return instrument::white_brdf(instrument_.white, pair);
                         });
    White result;
    const double changes = patch ? 0.0 : 2.0 * times_.change_s;
    const auto measure = [&](double brightness, int& frames) {
      double longest = 0.0;
      double seconds = 0.0;
      frames = 1;  // lamp off
      for (const ChannelRegions& regions : channels) {
        const Foreseen foreseen = brackets_.foresee(regions, options_.first_exposure, brightness);
        const int repeats = options_.white_frames - 1;
        seconds += foreseen.bracket.exposed_s + foreseen.bracket.frames * frame_s_ +
                   repeats * (devices::to_seconds(foreseen.found.start) + frame_s_);
        frames += foreseen.bracket.frames + repeats;
        longest = std::max(longest, foreseen.bracket.longest_s);
      }
      return changes + seconds + longest + frame_s_;
    };
    if (channels.front().empty()) return result;
    int dim_frames = 0;
    int bright_frames = 0;
    const double expected = measure(1.0, result.frames);
    const double dim = measure(std::exp(-kNinetyPercent * light_.sigma_ln), dim_frames);
    const double bright = measure(std::exp(kNinetyPercent * light_.sigma_ln), bright_frames);
    result.seconds = {expected, std::min({expected, dim, bright}),
                      std::max({expected, dim, bright}),
                      std::pow(times_.sigma_relative * changes, 2)};
    result.frames_high = std::max({result.frames, dim_frames, bright_frames});
    return result;
  }

  /// One axis after another, from wherever it stands.
  Uncertain homing() const {
    constexpr int kStarts = 100;
    Uncertain sum;
    for (const rig::Axis& axis : instrument_.rig.axes) {
      double mean = 0.0;
      double squares = 0.0;
      for (int i = 0; i < kStarts; ++i) {
        const Angle start = axis.min + (axis.max - axis.min) * ((i + 0.5) / kStarts);
        const double way = rig::rest_to_rest_seconds(
            (axis.home - start).degrees(), axis.max_speed_deg_per_s, axis.acceleration_deg_per_s2);
        mean += way / kStarts;
        squares += way * way / kStarts;
      }
      sum.seconds += mean + times_.index_search_s +
                     std::chrono::duration<double>(axis.settle).count() + times_.move_s;
      sum.variance += std::max(0.0, squares - mean * mean);
    }
    sum.variance += std::pow(times_.sigma_relative * sum.seconds, 2);
    sum.low = sum.high = sum.seconds;
    return sum;
  }

  /// Axes that stand at home: one after another they search their marks.
  Uncertain home_check() const {
    Uncertain sum;
    for (const rig::Axis& axis : instrument_.rig.axes) {
      sum.seconds += times_.index_search_s + std::chrono::duration<double>(axis.settle).count() +
                     times_.move_s;
    }
    sum.low = sum.high = sum.seconds;
    sum.variance = std::pow(times_.sigma_relative * sum.seconds, 2);
    return sum;
  }

  /// The first visit finds its exposures by a bracket.
  White sentinel(const rig::Joints& joints, const ExpectedSample& sample, bool first) const {
    const TargetSquare square{Eigen::Vector2d::Zero(), options_.sample_half_width_mm, 1};
    const auto channels = expected_regions(
        instrument_, rig::forward(instrument_.rig, joints), square, camera_.pixel_format, light_,
        [&](const brdf::DirectionPair& pair) { return sample.brdf(0, pair); });
    White result;
    if (channels.front().empty()) return result;
    const auto measure = [&](double brightness, int& frames) {
      double seconds = 0.0;
      frames = 0;
      for (const ChannelRegions& regions : channels) {
        const Foreseen foreseen = brackets_.foresee(regions, options_.first_exposure, brightness);
        if (first) seconds += foreseen.bracket.exposed_s + foreseen.bracket.frames * frame_s_;
        if (first) frames += foreseen.bracket.frames;
        constexpr int kFrames = kSentinelFrames + 1;  // and its background
        seconds += kFrames * (devices::to_seconds(foreseen.found.start) + frame_s_);
        frames += kFrames;
      }
      return seconds;
    };
    const double common = std::hypot(light_.sigma_ln, sample.sigma_ln);
    int dim_frames = 0;
    int bright_frames = 0;
    const double expected = measure(1.0, result.frames);
    const double dim = measure(std::exp(-kNinetyPercent * common), dim_frames);
    const double bright = measure(std::exp(kNinetyPercent * common), bright_frames);
    result.seconds = {expected, std::min({expected, dim, bright}),
                      std::max({expected, dim, bright}), 0.0};
    result.frames_high = std::max({result.frames, dim_frames, bright_frames});
    return result;
  }

  Uncertain darks() const {
    const double each = devices::to_seconds(camera_.min_exposure) + frame_s_;
    const double seconds = options_.dark_frames * each;
    return {seconds, seconds, seconds, 0.0};
  }

  Uncertain travel(const PlannedVisit& visit) const {
    const double legs = visit.travel_s > 0.0 ? 1.0 + static_cast<double>(visit.via.size()) : 0.0;
    const double seconds = visit.travel_s + legs * times_.move_s;
    // A rig that is slower than its description is so on every way: no square of its own.
    const double spread = kNinetyPercent * times_.sigma_relative * seconds;
    return {seconds, seconds - spread, seconds + spread, 0.0};
  }

 private:
  /// Seconds of a point whose regions are `brightness` times as bright as expected.
  double measure_point(const std::vector<ChannelRegions>& channels, double brightness, double noise,
                       ForecastPoint& point) const {
    std::chrono::nanoseconds start = options_.first_exposure;
    double seconds = 0.0;
    point.channels.clear();
    point.frames = 1;  // lamp off
    point.lamp_off_s = 0.0;
    for (const ChannelRegions& regions : channels) {
      const Foreseen foreseen = brackets_.foresee(regions, start, brightness, noise);
      start = foreseen.found.start;
      seconds += foreseen.bracket.exposed_s + foreseen.bracket.frames * frame_s_;
      point.frames += foreseen.bracket.frames;
      point.lamp_off_s = std::max(point.lamp_off_s, foreseen.bracket.longest_s);
      point.saturates = point.saturates || foreseen.found.saturated_regions > 0;
      point.dark = point.dark || foreseen.found.dark_regions > 0;
      point.short_of_sigma = point.short_of_sigma || foreseen.found.short_regions > 0;
      point.channels.push_back(foreseen.bracket);
    }
    return seconds + point.lamp_off_s + frame_s_;
  }

  const instrument::Instrument& instrument_;
  const SessionOptions& options_;
  const devices::CameraInfo& camera_;
  const ExpectedLight& light_;
  const RigTimes& times_;
  BracketForecaster brackets_;
  double frame_s_;
};

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
  const SessionForecaster forecaster(instrument, options, camera, light, times);
  std::vector<SessionForecaster::Point> points(plan.points.size());
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
  for (const PlannedVisit& visit : itinerary.visits) {
    const Uncertain way = forecaster.travel(visit);
    Uncertain stay;
    switch (visit.kind) {
      case VisitKind::home:
        stay = measured_some ? forecaster.home_check() : forecaster.homing();
        add(measured_some ? checks : home, stay);
        break;
      case VisitKind::sentinel: {
        const SessionForecaster::White sentinel =
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
        const SessionForecaster::White white = forecaster.white(visit.pose.joints);
        stay = white.seconds;
        forecast.frames += white.frames;
        forecast.frames_high += white.frames_high;
        add(measured_some ? closing : opening, stay);
        break;
      }
      case VisitKind::park:
        break;
      default: {
        measured_some = true;
        if (!visit.point) break;
        const SessionForecaster::Point& point = points[*visit.point];
        stay = point.measuring;
        forecast.frames += point.point.frames;
        forecast.frames_high += point.frames_high;
        add(measuring, stay);
      }
    }
    add(visit.kind == VisitKind::park ? park : travel, way);
    now += way.seconds + stay.seconds;
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
  for (SessionForecaster::Point& each : points) forecast.points.push_back(std::move(each.point));
  return forecast;
}

}  // namespace gonio::acquisition
