#include "gonio/calibration/sensor/axis_motion.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>

#include "gonio/random/stream.h"
#include "refused.h"

namespace gonio::calibration::sensor {
namespace {

using namespace gonio::literals;
using testing::HasSubstr;

constexpr double kReading_deg = 0.0004;

/// A shaft dragged through its play by a motor that ends beside its target, which the encoder on it
/// reads with a scatter of kReading_deg: nine targets, five times from either side.
std::vector<Approach> approaches(double play_deg, double sigma_deg, std::uint64_t seed,
                                 double zero_deg = 0.02) {
  random::Stream stream(random::make_key(seed, "axis"));
  std::vector<Approach> out;
  double shaft = 0.0;
  const auto drive = [&](double motor) {
    shaft = std::clamp(shaft, motor - 0.5 * play_deg, motor + 0.5 * play_deg);
  };
  for (int cycle = 0; cycle < 5; ++cycle) {
    for (int k = 0; k < 9; ++k) {
      const double target = -80.0 + 20.0 * k;
      for (const bool rising : {true, false}) {
        drive(target + (rising ? -1.0 : 1.0));
        drive(target);
        const double beside_deg = sigma_deg * stream.normal();
        out.push_back({Angle::from_degrees(target), rising,
                       Angle::from_degrees(target + beside_deg + kReading_deg * stream.normal()),
                       Angle::from_degrees(shaft + zero_deg + beside_deg)});
      }
    }
  }
  return out;
}

TEST(Repeatability, FindsBacklashAndScatter) {
  const auto found = fit_repeatability(approaches(0.05, 0.0036, 1));
  EXPECT_NEAR(found.backlash.value.degrees(), 0.05, 0.005);  // the tolerance
  EXPECT_LT(found.backlash.sigma.degrees(), 0.0002);         // where moves end is not in it
  EXPECT_NEAR(found.about_reading.value.degrees() / kReading_deg, 1.0, 0.3);
  EXPECT_NEAR(found.unidirectional.value.degrees() / 0.0036, 1.0, 0.3);
  EXPECT_NEAR(found.bidirectional.degrees(), 0.0253, 0.002);  // hypot(0.0036, 0.025)
  for (const instrument::AcceptanceCheck& acceptance : found.acceptance)
    EXPECT_TRUE(acceptance.passed());
  EXPECT_FALSE(fit_repeatability(approaches(0.15, 0.003, 2)).acceptance[0].passed());
  EXPECT_FALSE(fit_repeatability(approaches(0.05, 0.02, 3)).acceptance[1].passed());
}

TEST(Repeatability, SigmasCoverTheTruth) {
  constexpr int kDraws = 1000;
  int play_inside = 0;
  int sigma_inside = 0;
  int reading_inside = 0;
  for (int draw = 0; draw < kDraws; ++draw) {
    const auto found =
        fit_repeatability(approaches(0.05, 0.0036, 100 + static_cast<std::uint64_t>(draw)));
    const auto within = [](const AngleEstimate& estimate, double truth_deg) {
      return std::abs(estimate.value.degrees() - truth_deg) <= 2.0 * estimate.sigma.degrees();
    };
    if (within(found.backlash, 0.05)) ++play_inside;
    if (within(found.unidirectional, 0.0036)) ++sigma_inside;
    if (within(found.about_reading, kReading_deg)) ++reading_inside;
  }
  // 93 to 97 % of that many independent draws.
  EXPECT_GE(play_inside, kDraws * 93 / 100);
  EXPECT_LE(play_inside, kDraws * 97 / 100);
  EXPECT_GE(sigma_inside, kDraws * 93 / 100);
  EXPECT_LE(sigma_inside, kDraws * 97 / 100);
  EXPECT_GE(reading_inside, kDraws * 93 / 100);
  EXPECT_LE(reading_inside, kDraws * 97 / 100);
}

TEST(Repeatability, PlayThatDiffersAlongTheAxisWidensItsSigma) {
  auto series = approaches(0.05, 0.002, 4);
  for (Approach& approach : series) {
    if (!approach.rising) approach.observed += 0.0004 * approach.target;  // +-0.032 deg
  }
  const auto found = fit_repeatability(series);
  EXPECT_GT(found.backlash.sigma.degrees(), 0.005);
}

TEST(Repeatability, RefusesWhatIsNoSeries) {
  const auto good = approaches(0.05, 0.003, 5);
  const auto refused = [](std::vector<Approach> series) {
    return refusal([&] { fit_repeatability(series); });
  };
  EXPECT_EQ(refused(good), "");
  EXPECT_THAT(refused({}), HasSubstr("0 targets"));
  EXPECT_THAT(refused({good.begin(), good.begin() + 18}), HasSubstr("1 arrivals from below"));
  auto exchanged = good;
  for (Approach& approach : exchanged) approach.rising = !approach.rising;
  EXPECT_THAT(refused(exchanged), HasSubstr("exchanged"));
  auto broken = good;
  broken[7].observed = Angle::from_radians(std::nan(""));
  EXPECT_THAT(refused(broken), HasSubstr("seen at nan deg"));
  EXPECT_THAT(refusal([] { scatter(std::vector<Angle>(4)); }), HasSubstr("4 arrivals"));
}

TEST(Scatter, IsTheStandardDeviation) {
  const std::vector<Angle> marks{1.0_deg, 2.0_deg, 3.0_deg, 4.0_deg, 5.0_deg};
  EXPECT_NEAR(scatter(marks).value.degrees(), std::sqrt(2.5), 1e-12);
}

std::vector<AngleReading> ringing(double amplitude_deg, double decay_s, double noise_deg,
                                  std::uint64_t seed) {
  random::Stream stream(random::make_key(seed, "ring"));
  std::vector<AngleReading> out;
  for (int k = 0; k < 500; ++k) {
    const double t = 0.002 * k;
    const double ring = amplitude_deg * std::exp(-t / decay_s) * std::cos(94.0 * t);
    out.push_back({t, Angle::from_degrees(30.0 + ring + noise_deg * stream.normal())});
  }
  return out;
}

TEST(Settling, FindsWhenTheRingingIsOver) {
  const auto found = fit_settling(ringing(0.05, 0.05, 0.0002, 1));
  // The envelope 0.05 exp(-t / 0.05) is at 0.002 deg after 0.161 s; the last swing beyond it is at
  // most a half period, 33 ms, earlier.
  EXPECT_LE(found.settled_after_s, 0.165);
  EXPECT_GE(found.settled_after_s, 0.161 - 0.034);
  EXPECT_NEAR(found.final_angle.degrees(), 30.0, 0.0001);
  EXPECT_NEAR(found.ring_amplitude.degrees(), 0.05, 0.001);
  EXPECT_NEAR(found.noise.degrees(), 0.0002, 0.00005);
  EXPECT_EQ(fit_settling(ringing(0.0, 0.05, 0.0002, 2)).settled_after_s, 0.0);
}

TEST(Settling, RefusesAnAxisThatDoesNotRest) {
  EXPECT_THAT(refusal([] { fit_settling(ringing(0.05, 10.0, 0.0002, 3)); }),
              HasSubstr("still moves"));
  EXPECT_THAT(refusal([] { fit_settling(ringing(0.02, 0.35, 0.0001, 4)); }),
              HasSubstr("record longer"));
  EXPECT_THAT(refusal([] { fit_settling(ringing(0.05, 0.05, 0.003, 5)); }),
              HasSubstr("finer sensor"));
  EXPECT_THAT(refusal([] { fit_settling({}); }), HasSubstr("0 readings"));
  auto swapped = ringing(0.05, 0.05, 0.0002, 6);
  std::swap(swapped[3], swapped[4]);
  EXPECT_THAT(refusal([&] { fit_settling(swapped); }), HasSubstr("rising times"));
}

}  // namespace
}  // namespace gonio::calibration::sensor
