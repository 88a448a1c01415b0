#include "gonio/render/colour.h"

#include <gtest/gtest.h>

#include <array>

namespace gonio::render {
namespace {

constexpr double kLastDigit = 0.5e-4;  // the published figures have four decimals
constexpr double kRounding = 1e-9;

struct Pair {
  Lab first;
  Lab second;
  double published;
};

/// Sharma, Wu, Dalal 2005, table 1: all 34 pairs.
const std::array<Pair, 34>& sharma_pairs() {
  static const std::array<Pair, 34> pairs = {{
      {{50.0000, 2.6772, -79.7751}, {50.0000, 0.0000, -82.7485}, 2.0425},
      {{50.0000, 3.1571, -77.2803}, {50.0000, 0.0000, -82.7485}, 2.8615},
      {{50.0000, 2.8361, -74.0200}, {50.0000, 0.0000, -82.7485}, 3.4412},
      {{50.0000, -1.3802, -84.2814}, {50.0000, 0.0000, -82.7485}, 1.0000},
      {{50.0000, -1.1848, -84.8006}, {50.0000, 0.0000, -82.7485}, 1.0000},
      {{50.0000, -0.9009, -85.5211}, {50.0000, 0.0000, -82.7485}, 1.0000},
      {{50.0000, 0.0000, 0.0000}, {50.0000, -1.0000, 2.0000}, 2.3669},
      {{50.0000, -1.0000, 2.0000}, {50.0000, 0.0000, 0.0000}, 2.3669},
      {{50.0000, 2.4900, -0.0010}, {50.0000, -2.4900, 0.0009}, 7.1792},
      {{50.0000, 2.4900, -0.0010}, {50.0000, -2.4900, 0.0010}, 7.1792},
      {{50.0000, 2.4900, -0.0010}, {50.0000, -2.4900, 0.0011}, 7.2195},
      {{50.0000, 2.4900, -0.0010}, {50.0000, -2.4900, 0.0012}, 7.2195},
      {{50.0000, -0.0010, 2.4900}, {50.0000, 0.0009, -2.4900}, 4.8045},
      {{50.0000, -0.0010, 2.4900}, {50.0000, 0.0010, -2.4900}, 4.8045},
      {{50.0000, -0.0010, 2.4900}, {50.0000, 0.0011, -2.4900}, 4.7461},
      {{50.0000, 2.5000, 0.0000}, {50.0000, 0.0000, -2.5000}, 4.3065},
      {{50.0000, 2.5000, 0.0000}, {73.0000, 25.0000, -18.0000}, 27.1492},
      {{50.0000, 2.5000, 0.0000}, {61.0000, -5.0000, 29.0000}, 22.8977},
      {{50.0000, 2.5000, 0.0000}, {56.0000, -27.0000, -3.0000}, 31.9030},
      {{50.0000, 2.5000, 0.0000}, {58.0000, 24.0000, 15.0000}, 19.4535},
      {{50.0000, 2.5000, 0.0000}, {50.0000, 3.1736, 0.5854}, 1.0000},
      {{50.0000, 2.5000, 0.0000}, {50.0000, 3.2972, 0.0000}, 1.0000},
      {{50.0000, 2.5000, 0.0000}, {50.0000, 1.8634, 0.5757}, 1.0000},
      {{50.0000, 2.5000, 0.0000}, {50.0000, 3.2592, 0.3350}, 1.0000},
      {{60.2574, -34.0099, 36.2677}, {60.4626, -34.1751, 39.4387}, 1.2644},
      {{63.0109, -31.0961, -5.8663}, {62.8187, -29.7946, -4.0864}, 1.2630},
      {{61.2901, 3.7196, -5.3901}, {61.4292, 2.2480, -4.9620}, 1.8731},
      {{35.0831, -44.1164, 3.7933}, {35.0232, -40.0716, 1.5901}, 1.8645},
      {{22.7233, 20.0904, -46.6940}, {23.0331, 14.9730, -42.5619}, 2.0373},
      {{36.4612, 47.8580, 18.3852}, {36.2715, 50.5065, 21.2231}, 1.4146},
      {{90.8027, -2.0831, 1.4410}, {91.1528, -1.6435, 0.0447}, 1.4441},
      {{90.9257, -0.5406, -0.9208}, {88.6381, -0.8985, -0.7239}, 1.5381},
      {{6.7747, -0.2908, -2.4247}, {5.8714, -0.0985, -2.2286}, 0.6377},
      {{2.0776, 0.0795, -1.1350}, {0.9033, -0.0636, -0.5514}, 0.9082},
  }};
  return pairs;
}

TEST(DeltaE2000, AgreesWithThePublishedPairs) {
  for (std::size_t i = 0; i < sharma_pairs().size(); ++i) {
    const Pair& pair = sharma_pairs()[i];
    EXPECT_NEAR(delta_e_2000(pair.first, pair.second), pair.published, kLastDigit)
        << "pair " << i + 1;
  }
}

TEST(DeltaE2000, IsSymmetric) {
  for (std::size_t i = 0; i < sharma_pairs().size(); ++i) {
    // Pairs 10 and 14 lie exactly on the jump of the mean hue, where rounding picks the side.
    if (i == 9 || i == 13) continue;
    const Pair& pair = sharma_pairs()[i];
    EXPECT_NEAR(delta_e_2000(pair.second, pair.first), delta_e_2000(pair.first, pair.second),
                kRounding)
        << "pair " << i + 1;
  }
}

TEST(DeltaE2000, IsZeroForTheSameColour) {
  EXPECT_EQ(delta_e_2000({40.0, 30.0, -20.0}, {40.0, 30.0, -20.0}), 0.0);
  EXPECT_EQ(delta_e_2000({40.0, 0.0, 0.0}, {40.0, 0.0, 0.0}), 0.0);
}

TEST(Lab, WhiteAndGreysAreNeutral) {
  const Lab white = lab_from_linear_srgb({1.0, 1.0, 1.0});
  EXPECT_NEAR(white.x(), 100.0, kRounding);
  for (const double grey : {0.001, 0.18, 1.0}) {
    const Lab lab = lab_from_linear_srgb(Eigen::Array3d::Constant(grey));
    EXPECT_NEAR(lab.y(), 0.0, kRounding);
    EXPECT_NEAR(lab.z(), 0.0, kRounding);
  }
}

TEST(Lab, PrimariesLieWhereColourimetryPutsThem) {
  // sRGB red, green and blue under D65; two decimals are what tables of them agree on.
  constexpr double kTwoDecimals = 0.02;
  const Lab red = lab_from_linear_srgb({1.0, 0.0, 0.0});
  EXPECT_NEAR(red.x(), 53.24, kTwoDecimals);
  EXPECT_NEAR(red.y(), 80.09, kTwoDecimals);
  EXPECT_NEAR(red.z(), 67.20, kTwoDecimals);
  const Lab blue = lab_from_linear_srgb({0.0, 0.0, 1.0});
  EXPECT_NEAR(blue.x(), 32.30, kTwoDecimals);
  EXPECT_NEAR(blue.y(), 79.19, kTwoDecimals);
  EXPECT_NEAR(blue.z(), -107.86, kTwoDecimals);
}

TEST(Lab, GoesBackToTheSameLinearColour) {
  for (const Eigen::Array3d& rgb : {Eigen::Array3d(0.2, 0.7, 0.01), Eigen::Array3d(0.001, 0.0, 0.9),
                                    Eigen::Array3d(1.0, 1.0, 1.0)}) {
    const Eigen::Array3d back = linear_srgb_from_lab(lab_from_linear_srgb(rgb));
    EXPECT_LT((back - rgb).abs().maxCoeff(), kRounding);
  }
}

TEST(SrgbCurve, EncodesTheStandardsPoints) {
  EXPECT_NEAR(srgb_encode(0.5), 0.735357, 1e-6);  // 188 of 255 is half the light
  EXPECT_EQ(srgb_encode(0.0), 0.0);
  EXPECT_NEAR(srgb_encode(1.0), 1.0, kRounding);
  EXPECT_NEAR(srgb_encode(0.002), 0.02584, kRounding);  // the straight part: 12.92
  EXPECT_NEAR(srgb_encode(0.0031308), 0.04045, 1e-7);  // where the power law goes on, IEC 61966-2-1
}

}  // namespace
}  // namespace gonio::render
