#include "gonio/calibration/sensor/lamp_stability.h"

#include <gmock/gmock.h>

#include <cmath>
#include <vector>

#include "gonio/random/stream.h"
#include "refused.h"

namespace gonio::calibration::sensor {
namespace {

using testing::HasSubstr;

struct LampTruth {
  double amplitude = 0.05;
  double tau_s = 500.0;
  double noise = 0.0005;
  double wander = 0.0;  ///< sd of a slow random walk that returns in 300 s
};

std::vector<LampReading> record(const LampTruth& truth, std::uint64_t seed, double minutes = 60.0,
                                double first_s = 0.0) {
  random::Stream stream(random::make_key(seed, "lamp"));
  std::vector<LampReading> readings;
  constexpr double kStep_s = 10.0;
  const double keep = std::exp(-kStep_s / 300.0);
  double wander = truth.wander * stream.normal();
  for (double t = first_s; t <= first_s + 60.0 * minutes; t += kStep_s) {
    wander = keep * wander + std::sqrt(1.0 - keep * keep) * truth.wander * stream.normal();
    const double g = 1.0 - truth.amplitude * std::exp(-t / truth.tau_s);
    readings.push_back({t, 2000.0 * g * (1.0 + wander) * (1.0 + truth.noise * stream.normal())});
  }
  return readings;
}

TEST(LampStability, FindsTheWarmUp) {
  const auto found = fit_lamp_stability(record({}, 1));
  EXPECT_FALSE(found.already_warm);
  EXPECT_NEAR(found.level.value, 2000.0, 1.0);
  EXPECT_NEAR(found.amplitude.value, 0.05, 0.001);
  EXPECT_NEAR(found.tau_s.value, 500.0, 15.0);
  EXPECT_NEAR(found.sigma, 0.0005, 0.00005);
  // By hand: 0.05 (1 - exp(-1.2)) exp(-t / 500) = 0.002 at t = 500 ln(17.470).
  EXPECT_NEAR(found.warm_after_s.value, 1430.2, 20.0);
  EXPECT_LT(std::abs(found.drift_per_10_min.value), 0.0005);
  EXPECT_TRUE(found.acceptance.passed());
}

TEST(LampStability, SigmasCoverTheTruth) {
  constexpr int kDraws = 400;
  int amplitude_inside = 0;
  int tau_inside = 0;
  int warm_inside = 0;
  for (int draw = 0; draw < kDraws; ++draw) {
    const auto found = fit_lamp_stability(record({}, 100 + static_cast<std::uint64_t>(draw)));
    const auto within = [](const Estimate& estimate, double truth) {
      return std::abs(estimate.value - truth) <= 2.0 * estimate.sigma;
    };
    if (within(found.amplitude, 0.05)) ++amplitude_inside;
    if (within(found.tau_s, 500.0)) ++tau_inside;
    if (within(found.warm_after_s, 1430.2)) ++warm_inside;
  }
  expect_coverage(amplitude_inside, kDraws);
  expect_coverage(tau_inside, kDraws);
  expect_coverage(warm_inside, kDraws);
}

TEST(LampStability, AWanderingLampWidensTheSigmas) {
  constexpr int kDraws = 200;
  int inside = 0;
  for (int draw = 0; draw < kDraws; ++draw) {
    const auto found = fit_lamp_stability(
        record({.wander = 0.001}, 900 + static_cast<std::uint64_t>(draw), 120.0));
    EXPECT_GT(found.correlation, 3.0);
    if (std::abs(found.level.value - 2000.0) <= 2.0 * found.level.sigma) ++inside;
  }
  // The fit takes up part of the wander, so the sigma stays somewhat small: without the
  // correlation 2 sigma would cover a third.
  EXPECT_GE(inside, kDraws * 80 / 100);
}

TEST(LampStability, KnowsAWarmLamp) {
  const auto steady = fit_lamp_stability(record({.amplitude = 0.0}, 2));
  EXPECT_TRUE(steady.already_warm);
  EXPECT_EQ(steady.warm_after_s.value, 0.0);
  EXPECT_NEAR(steady.level.value, 2000.0, 4.0 * steady.level.sigma);
  const auto late = fit_lamp_stability(record({}, 3, 60.0, 4000.0));
  EXPECT_TRUE(late.already_warm);
}

TEST(LampStability, FailsALampThatDriftsOn) {
  auto readings = record({.amplitude = 0.0}, 4);
  for (LampReading& reading : readings) reading.value *= 1.0 - 0.005 * reading.time_s / 600.0;
  // 3 % in an hour, straight: no time constant within the record.
  EXPECT_THAT(refusal([&] { fit_lamp_stability(readings); }), HasSubstr("record longer"));
  auto late = record({.tau_s = 200.0}, 5);
  for (LampReading& reading : late) {
    if (reading.time_s > 3000.0) reading.value *= 1.0 - 0.005 * (reading.time_s - 3000.0) / 600.0;
  }
  const auto found = fit_lamp_stability(late);
  EXPECT_NEAR(found.drift_per_10_min.value, -0.005, 0.001);
  EXPECT_FALSE(found.acceptance.passed());
}

TEST(LampStability, RefusesBadRecords) {
  const auto refused = [](const std::vector<LampReading>& readings) {
    return refusal([&] { fit_lamp_stability(readings); });
  };
  const auto good = record({}, 6);
  EXPECT_EQ(refused(good), "");
  EXPECT_THAT(refused({}), HasSubstr("0 readings"));
  EXPECT_THAT(refused({good.begin(), good.begin() + 60}), HasSubstr("readings over 590 s"));
  auto off = good;
  off[10].value = 0.0;
  EXPECT_THAT(refused(off), HasSubstr("lamp is off"));
  auto nan = good;
  nan[10].value = std::nan("");
  EXPECT_THAT(refused(nan), HasSubstr("reading 10 is nan"));
  auto clock = good;
  clock[10].time_s = 5.0;
  EXPECT_THAT(refused(clock), HasSubstr("the clock was set"));
}

}  // namespace
}  // namespace gonio::calibration::sensor
