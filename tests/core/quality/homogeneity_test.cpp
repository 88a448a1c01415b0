#include "gonio/quality/homogeneity.h"

#include <gtest/gtest.h>

#include <cmath>

#include "gonio/random/stream.h"

namespace gonio::quality {
namespace {

constexpr int kGrid = 3;
constexpr int kSpots = kGrid * kGrid;

/// What a fit leaves: one common error per pose, a slope across the patch that is different in
/// every pose and strong (the directions' own), and noise; times the sample's own pattern.
struct Measurement {
  samples::SampleSet set;
  Eigen::MatrixXd fitted;
};

template <typename Pattern>
Measurement measured(int poses, std::uint64_t seed, Pattern&& pattern, double noise = 0.01) {
  random::Stream draw(random::make_key(seed, "test.homogeneity"));
  Measurement made;
  made.fitted.resize(poses * kSpots, 3);
  for (int pose = 0; pose < poses; ++pose) {
    const double level = 0.3 * draw.normal();
    const double along_x = 0.1 * draw.normal();
    const double along_y = 0.1 * draw.normal();
    for (int spot = 0; spot < kSpots; ++spot) {
      const double x = spot % kGrid - 1.0;
      const double y = spot / kGrid - 1.0;
      samples::Sample sample;
      sample.pose = pose;
      sample.spot = spot;
      const double fit = 0.2 + 0.05 * x;
      made.fitted.row(pose * kSpots + spot).setConstant(fit);
      const double value = fit * std::exp(level + along_x * x + along_y * y) * pattern(x, y);
      sample.value_per_sr = brdf::Rgb::Constant(value) *
                            (1.0 + noise * brdf::Rgb(draw.normal(), draw.normal(), draw.normal()));
      sample.sigma_per_sr = noise * sample.value_per_sr.abs();
      made.set.samples.push_back(std::move(sample));
    }
  }
  return made;
}

double even(double /*x*/, double /*y*/) { return 1.0; }

HomogeneityCheck check(const Measurement& made) {
  return check_homogeneity(made.set, made.fitted, 0.05);
}

TEST(Homogeneity, KeepsItsFalseAlarmRateWhateverFollowsTheDirections) {
  constexpr int kSessions = 300;
  constexpr int kMost = 28;  // 15 expected at 5 %; three and a half standard deviations more
  for (const int poses : {10, 20}) {
    int alarms = 0;
    for (int seed = 0; seed < kSessions; ++seed) {
      const auto result = check(measured(poses, static_cast<std::uint64_t>(seed), even));
      EXPECT_TRUE(result.applicable);
      alarms += result.passed ? 0 : 1;
    }
    EXPECT_LT(alarms, kMost) << poses << " poses";
  }
}

TEST(Homogeneity, SeesAGradientAndASpotAndSaysWhereAndHowMuch) {
  int gradients = 0;
  int spots = 0;
  for (std::uint64_t seed = 0; seed < 50; ++seed) {
    const auto gradient =
        check(measured(20, seed, [](double x, double) { return 1.0 + 0.15 * x; }));
    gradients += gradient.passed ? 0 : 1;
    if (!gradient.passed) {
      EXPECT_LT(gradient.pattern[3], gradient.pattern[5]);
      EXPECT_NEAR(gradient.rms, 0.12, 0.08);  // 0.15 sqrt(2/3), give or take the slopes' mean
    }
    const auto spot = check(
        measured(20, seed, [](double x, double y) { return x == 0.0 && y == 0.0 ? 0.8 : 1.0; }));
    spots += spot.passed ? 0 : 1;
    if (!spot.passed) {
      EXPECT_LT(spot.pattern[4], -0.1);
    }
  }
  EXPECT_GE(gradients, 45);
  EXPECT_GE(spots, 45);
}

TEST(Homogeneity, DoesNotMindTheLevelOfAPose) {
  // An even sample whose poses are all too bright is a matter of scale.
  const auto result = check(measured(10, 3, [](double, double) { return 1.7; }));
  const auto same = check(measured(10, 3, even));
  EXPECT_NEAR(result.p_value, same.p_value, 1e-12);
}

TEST(Homogeneity, IsNotJudgedFromFewPosesOrPoints) {
  const Measurement few = measured(7, 1, [](double x, double) { return 1.0 + 0.5 * x; });
  EXPECT_FALSE(check(few).applicable);
  EXPECT_TRUE(check(few).passed);
  Measurement points = measured(12, 1, even);
  for (samples::Sample& sample : points.set.samples) sample.spot = -1;
  EXPECT_FALSE(check(points).applicable);
  for (samples::Sample& sample : points.set.samples) sample.spot = 0;
  EXPECT_FALSE(check(points).applicable);
}

TEST(Homogeneity, LeavesOutDarkSamplesAndRefusesAnotherFit) {
  Measurement made = measured(10, 2, even);
  for (std::size_t i = 0; i < made.set.samples.size(); i += 2) {
    made.set.samples[i].value_per_sr.setConstant(-0.1);
  }
  EXPECT_TRUE(check(made).applicable);
  made.fitted.conservativeResize(5, 3);
  EXPECT_THROW(check(made), std::invalid_argument);
}

}  // namespace
}  // namespace gonio::quality
