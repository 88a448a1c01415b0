#include "gonio/instrument/hdr_merge.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "example_instrument.h"
#include "gonio/random/stream.h"

namespace gonio::instrument {
namespace {

SensorModel sensor() { return example_instrument().sensor; }

/// A frame of a uniform scene with the sensor's noise, drawn independently of the merge's formulas.
std::vector<std::uint16_t> noisy_frame(double electrons_per_s, double exposure_s,
                                       std::size_t pixels, random::Stream& stream) {
  std::vector<std::uint16_t> frame(pixels);
  for (auto& pixel : frame) {
    const double electrons = stream.poisson(electrons_per_s * exposure_s);
    const double dn = 64.0 + 0.39 * (electrons + 2.4 * stream.normal());
    pixel = static_cast<std::uint16_t>(std::clamp(std::floor(dn + 0.5), 0.0, 4095.0));
  }
  return frame;
}

double mean(const std::vector<double>& values) {
  double sum = 0.0;
  for (const double value : values) sum += value;
  return sum / static_cast<double>(values.size());
}

TEST(HdrMerge, ReturnsTheRateOfASingleNoiseFreeExposure) {
  SensorModel plain = sensor();
  plain.dark_current_e_per_s = 0.0;
  const std::vector<std::uint16_t> frame(20, 1064);
  const Exposure exposure{frame, 0.1};
  const MergedSignal merged = merge_bracket(plain, {&exposure, 1}, 5);
  EXPECT_NEAR(merged.dn_per_s[7], 10000.0, 1e-9);  // (1064 - 64) DN / 0.1 s
  // By hand: K^2 sigma_d^2 + 1/12 + K x = 0.876096 + 0.083333 + 390 = 390.959429 DN^2; / 0.01 s^2.
  EXPECT_NEAR(merged.variance[7], 39095.9429, 1e-3);
  EXPECT_EQ(merged.state[7], PixelState::measured);
}

TEST(HdrMerge, IsUnbiasedForVeryFewElectrons) {
  // 10 electrons in the longest exposure: weights from the data themselves would give -4.6 %.
  SensorModel plain = sensor();
  plain.dark_current_e_per_s = 0.0;
  constexpr std::size_t kPixels = 200000;
  constexpr double kRate = 10.0;
  random::Stream stream(random::make_key(11, "hdr few electrons"));
  std::vector<std::vector<std::uint16_t>> frames;
  std::vector<Exposure> bracket;
  for (const double t : {1.0 / 64.0, 1.0 / 16.0, 0.25, 1.0}) {
    frames.push_back(noisy_frame(kRate, t, kPixels, stream));
  }
  double t = 1.0 / 64.0;
  for (const auto& frame : frames) {
    bracket.push_back({frame, t});
    t *= 4.0;
  }
  const MergedSignal merged = merge_bracket(plain, bracket, 500);
  // Statistical error: sqrt(10) electrons / sqrt(200,000 pixels) is 0.07 % of 10.
  EXPECT_NEAR(mean(merged.dn_per_s) / (0.39 * kRate), 1.0, 0.004);
}

TEST(HdrMerge, ReportsTheScatterItHas) {
  SensorModel plain = sensor();
  plain.dark_current_e_per_s = 0.0;
  constexpr std::size_t kPixels = 50000;
  random::Stream stream(random::make_key(12, "hdr scatter"));
  const auto a = noisy_frame(2000.0, 0.1, kPixels, stream);
  const auto b = noisy_frame(2000.0, 0.4, kPixels, stream);
  const std::vector<Exposure> bracket{{a, 0.1}, {b, 0.4}};
  const MergedSignal merged = merge_bracket(plain, bracket, 500);
  const double centre = mean(merged.dn_per_s);
  double scatter = 0.0;
  for (const double value : merged.dn_per_s) scatter += (value - centre) * (value - centre);
  scatter /= kPixels - 1;
  EXPECT_NEAR(mean(merged.variance) / scatter, 1.0, 0.03);  // sd of a variance: sqrt(2/50,000)
}

TEST(HdrMerge, TakesBrightPixelsFromTheShortExposureOnly) {
  const std::vector<std::uint16_t> shorter(9, 2064);
  std::vector<std::uint16_t> longer(9, 4095);
  const std::vector<Exposure> bracket{{longer, 0.4}, {shorter, 0.1}};
  const MergedSignal merged = merge_bracket(sensor(), bracket, 3);
  EXPECT_NEAR(merged.dn_per_s[4], 20000.0 - 0.39 * 5.0, 1e-6);
  EXPECT_EQ(merged.state[4], PixelState::measured);
}

TEST(HdrMerge, NeverMakesAValueOfSaturation) {
  std::vector<std::uint16_t> frame(11 * 11, 500);
  frame[5 * 11 + 5] = 4095;
  const Exposure exposure{frame, 0.01};
  const MergedSignal merged = merge_bracket(sensor(), {&exposure, 1}, 11);
  EXPECT_EQ(merged.state[5 * 11 + 5], PixelState::saturated);
  EXPECT_EQ(merged.state[3 * 11 + 7], PixelState::saturated) << "2 px away: blooming";
  EXPECT_EQ(merged.state[2 * 11 + 5], PixelState::measured) << "3 px away";
}

TEST(HdrMerge, NeverMakesAValueOfBlackClip) {
  const std::vector<std::uint16_t> frame(4, 0);
  const Exposure exposure{frame, 0.01};
  EXPECT_EQ(merge_bracket(sensor(), {&exposure, 1}, 2).state[0], PixelState::black_clipped);
}

TEST(HdrMerge, SubtractsTheBackgroundItIsGiven) {
  const std::vector<std::uint16_t> frame(4, 1000);
  const std::vector<double> offset(4, 70.0);
  const std::vector<double> rate(4, 30.0);
  const Exposure exposure{frame, 1.0};
  const MergedSignal merged = merge_bracket(sensor(), {&exposure, 1}, 2, {offset, rate});
  EXPECT_NEAR(merged.dn_per_s[0], 900.0, 1e-9);
}

/// What the simulated sensor does, in its own words: y (1 - 0.003 (y / 4095)^2) of all that is
/// read, and light for 3 us longer than reported.
struct BentSensor {
  static constexpr double kBlack_dn = 64.0;
  static constexpr double kBend = 0.003;
  static constexpr double kOffset_s = 3e-6;

  static std::vector<std::uint16_t> frame(double electrons_per_s, double exposure_s,
                                          std::size_t pixels, random::Stream& stream) {
    std::vector<std::uint16_t> frame(pixels);
    for (auto& pixel : frame) {
      const double electrons =
          std::min(10500.0, stream.poisson(electrons_per_s * (exposure_s + kOffset_s)));
      const double dn = kBlack_dn + 0.39 * (electrons + 2.4 * stream.normal());
      const double bent = dn * (1.0 - kBend * std::pow(dn / 4095.0, 2));
      pixel = static_cast<std::uint16_t>(std::clamp(std::floor(bent + 0.5), 0.0, 4095.0));
    }
    return frame;
  }

  /// By hand: with m the signal above black as measured, the bend takes
  /// (0.003 / 4095^2) (m^3 + 3 black m^2) off the straight signal, to first order.
  static SensorModel known() {
    SensorModel known = sensor();
    known.dark_current_e_per_s = 0.0;
    known.saturation_dn = 4075.0;
    const double range = known.saturation_dn - kBlack_dn;
    const double at_range = kBend * std::pow(range / 4095.0, 2);
    known.response = {range, 3.0 * kBlack_dn / range * at_range, at_range};
    known.shutter_offset_s = kOffset_s;
    return known;
  }
};

TEST(HdrMerge, IsLinearOverFiveDecadesOfABentSensor) {
  constexpr std::size_t kPixels = 20000;
  random::Stream stream(random::make_key(13, "hdr five decades"));
  for (double rate = 2.7e3; rate < 3e8; rate *= 10.0) {  // electrons per second
    std::vector<std::vector<std::uint16_t>> frames;
    std::vector<Exposure> bracket;
    for (int k = 0; k < 9; ++k) {  // 30 us to 2 s
      const double t = 30e-6 * std::ldexp(1.0, 2 * k);
      if (rate * t > 50 * 10500.0) break;  // deep in saturation, as the longer ones would be
      frames.push_back(BentSensor::frame(rate, t, kPixels, stream));
    }
    double t = 30e-6;
    for (const auto& frame : frames) {
      bracket.push_back({frame, t});
      t *= 4.0;
    }
    const MergedSignal merged = merge_bracket(BentSensor::known(), bracket, 500);
    // The 0.3 % of the specification would not see the bend, 0.2 % at the brightest. Noise: 0.02 %.
    EXPECT_NEAR(mean(merged.dn_per_s) / (0.39 * rate), 1.0, 0.001) << rate << " e/s";
  }
}

TEST(HdrMerge, TakesAnExposureToLastForTheShutterOffsetMore) {
  SensorModel plain = sensor();
  plain.dark_current_e_per_s = 0.0;
  plain.shutter_offset_s = 5e-6;
  const std::vector<std::uint16_t> frame(4, 314);
  const std::vector<double> rate(4, 1e6);
  const Exposure exposure{frame, 20e-6};
  // 250 DN in 25 us, and a background of 1e6 DN/s.
  EXPECT_NEAR(merge_bracket(plain, {&exposure, 1}, 2, {{}, rate}).dn_per_s[3], 9e6, 1e-3);
  plain.shutter_offset_s = -20e-6;
  EXPECT_THROW(merge_bracket(plain, {&exposure, 1}, 2), std::invalid_argument);
}

TEST(HdrMerge, MakesNoValueOfABadPixelNorLetsItSpoilOthers) {
  SensorModel known = sensor();
  known.bad_pixels = {{5, 4}};
  std::vector<std::uint16_t> frame(11 * 11, 564);
  frame[4 * 11 + 5] = 4095;  // hot: full without light
  const Exposure exposure{frame, 0.01};
  const MergedSignal merged = merge_bracket(known, {&exposure, 1}, 11);
  EXPECT_EQ(merged.state[4 * 11 + 5], PixelState::defective);
  EXPECT_EQ(merged.dn_per_s[4 * 11 + 5], 0.0);
  EXPECT_EQ(merged.state[5 * 11 + 4], PixelState::measured) << "the pixel beyond the diagonal";
  EXPECT_EQ(std::count(merged.state.begin(), merged.state.end(), PixelState::measured), 120);
  known.bad_pixels = {{11, 4}};
  EXPECT_THROW(merge_bracket(known, {&exposure, 1}, 11), std::invalid_argument);
}

TEST(HdrMerge, RefusesBracketsThatDoNotFit) {
  const std::vector<std::uint16_t> four(4, 1000);
  const std::vector<std::uint16_t> six(6, 1000);
  EXPECT_THROW(merge_bracket(sensor(), {}, 2), std::invalid_argument);
  const std::vector<Exposure> sizes{{four, 1.0}, {six, 2.0}};
  EXPECT_THROW(merge_bracket(sensor(), sizes, 2), std::invalid_argument);
  const std::vector<Exposure> time{{four, 0.0}};
  EXPECT_THROW(merge_bracket(sensor(), time, 2), std::invalid_argument);
  const std::vector<Exposure> rows{{four, 1.0}};
  EXPECT_THROW(merge_bracket(sensor(), rows, 3), std::invalid_argument);
}

}  // namespace
}  // namespace gonio::instrument
