#include "gonio/basis/log_mapping.h"

#include <gtest/gtest.h>

#include <cmath>

#include "test_materials.h"

namespace gonio::basis {
namespace {

constexpr double kRounding = 1e-12;

TEST(LogMapping, InverseUndoesForwardOverTenDecades) {
  const LogMapping mapping;
  for (const double weight : {0.01, 0.3, 1.0}) {
    for (double f = 1e-5; f < 1e5; f *= 3.0) {
      EXPECT_NEAR(mapping.inverse(mapping.forward(f, weight), weight), f,
                  f * kRounding + 1e-15 / weight);
    }
  }
}

TEST(LogMapping, BlackIsTheLogarithmOfEpsilon) {
  EXPECT_NEAR(LogMapping{}.forward(0.0, 0.5), std::log(1e-3), kRounding);
}

TEST(LogMapping, HasNoValueForASampleBelowMinusEpsilon) {
  EXPECT_TRUE(std::isnan(LogMapping{}.forward(-0.002, 0.5)));
  EXPECT_FALSE(std::isnan(LogMapping{}.forward(-0.001, 0.5)));
}

TEST(LogMapping, NeverReturnsANegativeBrdf) { EXPECT_EQ(LogMapping{}.inverse(-20.0, 0.5), 0.0); }

TEST(LogMapping, DerivativeIsTheSlopeOfForward) {
  const LogMapping mapping;
  const double step = 1e-6;
  const double slope =
      (mapping.forward(0.2 + step, 0.4) - mapping.forward(0.2 - step, 0.4)) / (2.0 * step);
  EXPECT_NEAR(mapping.derivative(0.2, 0.4), slope, 1e-8);  // third-order term of the difference
}

TEST(LogMapping, WeightIsTheProductOfCosinesClippedAtTheFloor) {
  const LogMapping mapping;
  EXPECT_NEAR(mapping.weight({0.5, 0.8}), 0.4, kRounding);
  EXPECT_EQ(mapping.weight({0.01, 0.02}), 0.01);
  EXPECT_EQ(mapping.weight({-0.1, 0.5}), 0.01);
}

}  // namespace
}  // namespace gonio::basis
