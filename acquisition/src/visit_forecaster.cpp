#include "visit_forecaster.h"

#include <algorithm>
#include <cmath>

#include "exposure_prediction.h"
#include "gonio/acquisition/trust_notes.h"
#include "gonio/devices/clock.h"

namespace gonio::acquisition {

VisitForecaster::Point VisitForecaster::point(std::size_t index, const PlannedPoint& planned,
                                              const ExpectedSample& sample) const {
  const TargetSquare square{Eigen::Vector2d::Zero(), options_.sample_half_width_mm, 3};
  const auto channels = expected_regions(
      instrument_, rig::forward(instrument_.rig, planned.pose.joints), square, camera_.pixel_format,
      light_, [&](const brdf::DirectionPair& pair) { return sample.brdf(index, pair); });
  Point result;
  result.point.in_view = !channels.front().empty();
  if (!result.point.in_view) return result;
  const double common = std::hypot(light_.sigma_ln, sample.sigma_ln);
  const auto scaled = [&](double sigmas, double sigma_ln) { return std::exp(sigmas * sigma_ln); };
  const auto light = [&](double sigmas) {
    return common > 0.0 ? std::exp(sigmas * light_.sigma_ln * light_.sigma_ln / common) : 1.0;
  };
  // Three nodes of a normal distribution: brackets go by steps, and their mean over many points
  // is not the bracket of the mean. Dim and noisy stand together: both ask for more.
  constexpr double kNode = 1.7320508;
  const auto seconds = [&](double node) {
    ForecastPoint other;
    return measure_point(channels, sample, scaled(node, sample.point_sigma_ln), -node, other);
  };
  const double expected = measure_point(channels, sample, 1.0, 0.0, result.point);
  const double dimmer = seconds(-kNode);
  const double brighter = seconds(kNode);
  const double mean = (4.0 * expected + dimmer + brighter) / 6.0;
  result.measuring.variance = (4.0 * std::pow(expected - mean, 2) + std::pow(dimmer - mean, 2) +
                               std::pow(brighter - mean, 2)) /
                              6.0;
  ForecastPoint dim;
  ForecastPoint bright;
  const double dimmest = measure_point(channels, sample, scaled(-kNinetyPercent, common), 0.0, dim,
                                       light(-kNinetyPercent));
  const double brightest = measure_point(channels, sample, scaled(kNinetyPercent, common), 0.0,
                                         bright, light(kNinetyPercent));
  result.measuring.seconds = mean;
  result.measuring.low = std::min({mean, dimmest, brightest});
  result.measuring.high = std::max({mean, dimmest, brightest});
  result.frames_high = std::max({result.point.frames, dim.frames, bright.frames});
  const double own = kNinetyPercent * std::sqrt(result.measuring.variance);
  result.point.measuring_s = {mean, mean - std::hypot(mean - result.measuring.low, own),
                              mean + std::hypot(result.measuring.high - mean, own)};
  return result;
}

VisitForecaster::Target VisitForecaster::white(const rig::Joints& joints) const {
  const bool patch = options_.white == WhitePlacement::in_frame;
  const auto channels =
      expected_regions(instrument_, rig::forward(instrument_.rig, joints), white_square(options_),
                       camera_.pixel_format, light_, [&](const brdf::DirectionPair& pair) {
                         return instrument::white_brdf(instrument_.white, pair);
                       });
  Target result;
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
  result.seconds = {expected, std::min({expected, dim, bright}), std::max({expected, dim, bright}),
                    std::pow(times_.sigma_relative * changes, 2)};
  result.frames_high = std::max({result.frames, dim_frames, bright_frames});
  return result;
}

Uncertain VisitForecaster::homing() const {
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

Uncertain VisitForecaster::home_check() const {
  Uncertain sum;
  for (const rig::Axis& axis : instrument_.rig.axes) {
    sum.seconds +=
        times_.index_search_s + std::chrono::duration<double>(axis.settle).count() + times_.move_s;
  }
  sum.low = sum.high = sum.seconds;
  sum.variance = std::pow(times_.sigma_relative * sum.seconds, 2);
  return sum;
}

VisitForecaster::Target VisitForecaster::sentinel(const rig::Joints& joints,
                                                  const ExpectedSample& sample, bool first) const {
  const TargetSquare square{Eigen::Vector2d::Zero(), options_.sample_half_width_mm, 1};
  const auto channels = expected_regions(
      instrument_, rig::forward(instrument_.rig, joints), square, camera_.pixel_format, light_,
      [&](const brdf::DirectionPair& pair) { return sample.brdf(0, pair); });
  Target result;
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
  result.seconds = {expected, std::min({expected, dim, bright}), std::max({expected, dim, bright}),
                    0.0};
  result.frames_high = std::max({result.frames, dim_frames, bright_frames});
  return result;
}

Uncertain VisitForecaster::darks() const {
  const double each = devices::to_seconds(camera_.min_exposure) + frame_s_;
  const double seconds = options_.dark_frames * each;
  return {seconds, seconds, seconds, 0.0};
}

Uncertain VisitForecaster::travel(const PlannedVisit& visit) const {
  const double legs = visit.travel_s > 0.0 ? 1.0 + static_cast<double>(visit.via.size()) : 0.0;
  const double seconds = visit.travel_s + legs * times_.move_s;
  // A rig that is slower than its description is so on every way: no square of its own.
  const double spread = kNinetyPercent * times_.sigma_relative * seconds;
  return {seconds, seconds - spread, seconds + spread, 0.0};
}

double VisitForecaster::measure_point(const std::vector<ChannelRegions>& channels,
                                      const ExpectedSample& sample, double brightness, double noise,
                                      ForecastPoint& point, double light) const {
  double seconds = 0.0;
  point.channels.clear();
  point.frames = 1;  // lamp off
  point.lamp_off_s = 0.0;
  for (const ChannelRegions& regions : channels) {
    const auto start =
        predicted_exposure(regions, instrument_.sensor, options_, camera_, light * sample.margin());
    const Foreseen foreseen = brackets_.foresee(regions, start, brightness, noise);
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

}  // namespace gonio::acquisition
