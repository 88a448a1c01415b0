#include "gonio/calibration/sensor/axis_motion.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "gonio/calibration/result/step_refused.h"

namespace gonio::calibration::sensor {
namespace {

constexpr const char* kRepeatStep = "repeatability";
constexpr const char* kSettleStep = "settling";
constexpr double kSameTarget_rad = 1e-7;  // a hundredth of the finest encoder step

/// Mean and sum of squares about it, one value at a time (Welford, Technometrics 4, 1962).
struct Arrivals {
  double count = 0.0;
  double mean = 0.0;
  double squares = 0.0;

  void add(double value) {
    count += 1.0;
    const double before = value - mean;
    mean += before / count;
    squares += before * (value - mean);
  }
};

/// From one side, at one target.
struct Side {
  Arrivals about_target;
  Arrivals about_reading;
};

struct TargetArrivals {
  double target = 0.0;
  Side rising;
  Side falling;
};

std::vector<TargetArrivals> by_target(std::span<const Approach> approaches) {
  std::map<long long, TargetArrivals> targets;
  for (const Approach& approach : approaches) {
    const double target = approach.target.radians();
    const double observed = approach.observed.radians();
    const double reading = approach.reading.radians();
    constexpr double kTurns_rad = 1e4;  // more is no angle of an axis
    if (!(std::abs(target) < kTurns_rad) || !(std::abs(observed) < kTurns_rad) ||
        !(std::abs(reading) < kTurns_rad)) {
      throw StepRefused(
          fmt::format("{}: seen at {} deg and read as {} deg for a target of {} deg, expected "
                      "numbers: measure again",
                      kRepeatStep, approach.observed.degrees(), approach.reading.degrees(),
                      approach.target.degrees()));
    }
    TargetArrivals& entry = targets[std::llround(target / kSameTarget_rad)];
    entry.target = target;
    Side& side = approach.rising ? entry.rising : entry.falling;
    side.about_target.add(observed - target);
    side.about_reading.add(observed - reading);
  }
  std::vector<TargetArrivals> sorted;
  for (const auto& [key, entry] : targets) sorted.push_back(entry);
  return sorted;
}

void check_targets(const std::vector<TargetArrivals>& targets) {
  constexpr std::size_t kTargets = 3;
  constexpr double kArrivals = 2.0;
  if (targets.size() < kTargets) {
    throw StepRefused(fmt::format("{}: {} targets, expected at least {}: measure more", kRepeatStep,
                                  targets.size(), kTargets));
  }
  for (const TargetArrivals& target : targets) {
    const double rising = target.rising.about_target.count;
    const double falling = target.falling.about_target.count;
    if (std::min(rising, falling) < kArrivals) {
      throw StepRefused(fmt::format(
          "{}: {} arrivals from below and {} from above at {:.3f} deg, expected at "
          "least {} of each",
          kRepeatStep, rising, falling, Angle::from_radians(target.target).degrees(), kArrivals));
    }
  }
}

double sd_of(const std::vector<double>& values) {
  Arrivals all;
  for (const double value : values) all.add(value);
  return std::sqrt(all.squares / (all.count - 1.0));
}

}  // namespace

Repeatability fit_repeatability(std::span<const Approach> approaches) {
  const std::vector<TargetArrivals> targets = by_target(approaches);
  check_targets(targets);

  Repeatability result;
  double squares_about_target = 0.0;
  double squares_about_reading = 0.0;
  double freedom = 0.0;
  double inverse_counts = 0.0;
  std::vector<double> plays;
  double play = 0.0;
  const auto count = static_cast<double>(targets.size());
  for (const TargetArrivals& target : targets) {
    const Arrivals& rising = target.rising.about_reading;
    const Arrivals& falling = target.falling.about_reading;
    squares_about_target +=
        target.rising.about_target.squares + target.falling.about_target.squares;
    squares_about_reading += rising.squares + falling.squares;
    freedom += rising.count + falling.count - 2.0;
    inverse_counts += 1.0 / rising.count + 1.0 / falling.count;
    plays.push_back(falling.mean - rising.mean);
    play += plays.back() / count;
  }
  const double sigma = std::sqrt(squares_about_target / freedom);
  const double about_reading = std::sqrt(squares_about_reading / freedom);
  // Two ways to the sigma: by the arrivals, and by what the targets disagree. A play that differs
  // along the axis shows in the second only.
  const double by_arrivals = about_reading * std::sqrt(inverse_counts) / count;
  const double by_targets = sd_of(plays) / std::sqrt(count);
  constexpr double kDiffers = 1.5;  // of few targets, less is chance
  const double play_sigma = by_targets > kDiffers * by_arrivals ? by_targets : by_arrivals;
  constexpr double kNegative = 3.0;
  if (play < -kNegative * std::max(play_sigma, kSameTarget_rad)) {
    throw StepRefused(fmt::format(
        "{}: a backlash of {:.4f} deg, expected 0 or more: the sensor counts the other way, or "
        "rising and falling approaches are exchanged",
        kRepeatStep, Angle::from_radians(play).degrees()));
  }
  result.backlash = {Angle::from_radians(play), Angle::from_radians(play_sigma)};
  const auto sd = [&](double value) {
    return AngleEstimate{Angle::from_radians(value),
                         Angle::from_radians(value / std::sqrt(2.0 * freedom))};
  };
  result.unidirectional = sd(sigma);
  result.about_reading = sd(about_reading);
  result.bidirectional = Angle::from_radians(std::hypot(sigma, 0.5 * play));
  constexpr double kMaxBacklash_deg = 0.1;  // calibration routine, step 3
  constexpr double kMaxSigma_deg = 0.01;
  result.acceptance = {
      {"backlash (deg)", kMaxBacklash_deg, result.backlash.value.degrees()},
      {"unidirectional repeatability (deg)", kMaxSigma_deg, result.unidirectional.value.degrees()}};
  return result;
}

AngleEstimate scatter(std::span<const Angle> observed) {
  constexpr std::size_t kFewest = 5;
  if (observed.size() < kFewest) {
    throw StepRefused(fmt::format("{}: {} arrivals, expected at least {}: repeat more often",
                                  kRepeatStep, observed.size(), kFewest));
  }
  Arrivals all;
  for (const Angle angle : observed) all.add(angle.radians());
  if (!std::isfinite(all.squares)) {
    throw StepRefused(fmt::format("{}: an arrival is not a number: measure again", kRepeatStep));
  }
  const double sigma = std::sqrt(all.squares / (all.count - 1.0));
  return {Angle::from_radians(sigma),
          Angle::from_radians(sigma / std::sqrt(2.0 * (all.count - 1.0)))};
}

Settling fit_settling(std::span<const AngleReading> readings, const SettlingOptions& options) {
  constexpr std::size_t kFewest = 40;
  if (readings.size() < kFewest) {
    throw StepRefused(fmt::format("{}: {} readings, expected at least {}: read faster or longer",
                                  kSettleStep, readings.size(), kFewest));
  }
  for (std::size_t k = 0; k < readings.size(); ++k) {
    const bool rises = k == 0 || readings[k].time_s > readings[k - 1].time_s;
    if (!rises || !std::isfinite(readings[k].time_s) ||
        !std::isfinite(readings[k].angle.radians())) {
      throw StepRefused(
          fmt::format("{}: reading {} is {} deg at {} s, expected numbers at rising "
                      "times",
                      kSettleStep, k, readings[k].angle.degrees(), readings[k].time_s));
    }
  }
  const std::size_t quarter = readings.size() - readings.size() / 4;
  Arrivals tail;
  for (std::size_t k = quarter; k < readings.size(); ++k) tail.add(readings[k].angle.radians());
  const double noise = std::sqrt(tail.squares / (tail.count - 1.0));
  const double tolerance = options.tolerance.radians();
  constexpr double kShare = 0.5;
  if (noise > kShare * tolerance) {
    throw StepRefused(fmt::format(
        "{}: the last quarter scatters by {:.5f} deg, expected less than {:.5f}: the axis still "
        "moves, record longer, or use a finer sensor",
        kSettleStep, Angle::from_radians(noise).degrees(), kShare * options.tolerance.degrees()));
  }
  Settling result;
  result.final_angle = Angle::from_radians(tail.mean);
  result.noise = Angle::from_radians(noise);
  constexpr double kNoiseSigmas = 3.0;
  const double outside = std::hypot(tolerance, kNoiseSigmas * noise);
  std::size_t inside_from = 0;
  double largest = 0.0;
  for (std::size_t k = 0; k < readings.size(); ++k) {
    const double distance = std::abs(readings[k].angle.radians() - tail.mean);
    largest = std::max(largest, distance);
    if (distance > outside) inside_from = k + 1;
  }
  if (inside_from >= quarter) {
    throw StepRefused(fmt::format(
        "{}: still {:.4f} deg off at {:.3f} s, in the last quarter of the record, expected rest "
        "there: record longer",
        kSettleStep,
        Angle::from_radians(std::abs(readings[inside_from - 1].angle.radians() - tail.mean))
            .degrees(),
        readings[inside_from - 1].time_s));
  }
  result.ring_amplitude = Angle::from_radians(largest);
  if (inside_from > 0) {
    const double from = readings[inside_from - 1].time_s;
    const double to = readings[inside_from].time_s;
    result.settled_after_s = 0.5 * (from + to);
    result.sigma_s = (to - from) / std::sqrt(12.0);
  }
  return result;
}

}  // namespace gonio::calibration::sensor
