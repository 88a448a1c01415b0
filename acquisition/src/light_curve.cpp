#include "light_curve.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace gonio::acquisition {

LightCurve::LightCurve(const std::vector<Reading>& readings) {
  for (const Reading& reading : readings) {
    if (readings_.empty() || reading.time_s > readings_.back().time_s) readings_.push_back(reading);
  }
  if (!shows_drift()) return;
  std::vector<std::size_t> segments(readings_.size() - 1);
  for (int colour = 0; colour < 3; ++colour) {
    std::iota(segments.begin(), segments.end(), std::size_t{0});
    std::sort(segments.begin(), segments.end(),
              [&](std::size_t a, std::size_t b) { return slope(a)[colour] < slope(b)[colour]; });
    const std::size_t lower = segments[(segments.size() - 1) / 2];
    const std::size_t upper = segments[segments.size() / 2];
    const bool upper_is_less = std::abs(slope(upper)[colour]) < std::abs(slope(lower)[colour]);
    usual_[static_cast<std::size_t>(colour)] = upper_is_less ? upper : lower;
  }
}

brdf::Rgb LightCurve::slope(std::size_t i) const {
  return (readings_[i + 1].level - readings_[i].level) /
         (readings_[i + 1].time_s - readings_[i].time_s);
}

bool LightCurve::is_beyond(double time_s) const {
  return time_s < readings_.front().time_s || time_s > readings_.back().time_s;
}

std::size_t LightCurve::segment(double time_s) const {
  std::size_t i = 0;
  while (i + 2 < readings_.size() && readings_[i + 1].time_s < time_s) ++i;
  return i;
}

brdf::Rgb LightCurve::level(double time_s) const {
  if (!shows_drift()) return readings_.front().level;
  if (!is_beyond(time_s)) {
    const std::size_t i = segment(time_s);
    return readings_[i].level + (time_s - readings_[i].time_s) * slope(i);
  }
  const Reading& end = time_s < readings_.front().time_s ? readings_.front() : readings_.back();
  brdf::Rgb level;
  for (int colour = 0; colour < 3; ++colour) {
    const double usual = slope(usual_[static_cast<std::size_t>(colour)])[colour];
    level[colour] = end.level[colour] + (time_s - end.time_s) * usual;
  }
  // What comes of an archive that somebody made up is still a number.
  constexpr double kLeast = 0.1;
  return level.max(kLeast * end.level);
}

std::vector<double> LightCurve::weights(double time_s, int colour) const {
  std::vector<double> weights(readings_.size(), 0.0);
  if (!shows_drift()) {
    weights.front() = 1.0;
    return weights;
  }
  const bool beyond = is_beyond(time_s);
  const bool before = time_s < readings_.front().time_s;
  const std::size_t i = beyond ? usual_[static_cast<std::size_t>(colour)] : segment(time_s);
  const std::size_t from = !beyond ? i : before ? 0 : readings_.size() - 1;
  const double share =
      (time_s - readings_[from].time_s) / (readings_[i + 1].time_s - readings_[i].time_s);
  weights[from] += 1.0;
  weights[i] -= share;
  weights[i + 1] += share;
  return weights;
}

brdf::Rgb LightCurve::uneven(double time_s) const {
  if (!shows_drift()) return brdf::Rgb::Zero();
  brdf::Rgb variance;
  for (int colour = 0; colour < 3; ++colour) {
    const double usual = slope(usual_[static_cast<std::size_t>(colour)])[colour];
    if (is_beyond(time_s)) {
      const bool before = time_s < readings_.front().time_s;
      const Reading& end = before ? readings_.front() : readings_.back();
      const double next = slope(before ? 0 : readings_.size() - 2)[colour];
      const double fastest = std::max(std::abs(usual), std::abs(next));
      variance[colour] = std::pow((time_s - end.time_s) * fastest / end.level[colour], 2) / 3.0;
      continue;
    }
    const std::size_t i = segment(time_s);
    const double whole_s = readings_[i + 1].time_s - readings_[i].time_s;
    const double share = (time_s - readings_[i].time_s) / whole_s;
    // One segment alone says nothing of how even it was.
    const double even = readings_.size() > 2 ? usual : 0.0;
    const double step = (slope(i)[colour] - even) * whole_s / readings_[i].level[colour];
    variance[colour] = share * (1.0 - share) * step * step;
  }
  return variance;
}

LightCurve::Reading LightCurve::at(double time_s) const {
  Reading found{time_s, level(time_s), uneven(time_s)};
  for (int colour = 0; colour < 3; ++colour) {
    const std::vector<double> own = weights(time_s, colour);
    for (std::size_t i = 0; i < own.size(); ++i) {
      found.variance[colour] += own[i] * own[i] * readings_[i].variance[colour];
    }
  }
  return found;
}

LevelChange LightCurve::change(double from_s, double to_s) const {
  LevelChange change{level(to_s) / level(from_s) - 1.0, uneven(from_s) + uneven(to_s)};
  for (int colour = 0; colour < 3; ++colour) {
    const std::vector<double> from = weights(from_s, colour);
    const std::vector<double> to = weights(to_s, colour);
    for (std::size_t i = 0; i < from.size(); ++i) {
      change.variance[colour] += std::pow(to[i] - from[i], 2) * readings_[i].variance[colour];
    }
  }
  return change;
}

}  // namespace gonio::acquisition
