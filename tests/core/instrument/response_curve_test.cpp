#include "gonio/instrument/response_curve.h"

#include <gtest/gtest.h>

#include "gonio/errors/errors.h"

namespace gonio::instrument {
namespace {

TEST(ResponseCurve, InverseUndoesIt) {
  const ResponseCurve curve{4000.0, 0.02, -0.01};
  constexpr double kRounding_dn = 1e-8;
  for (const double measured : {-5.0, 0.0, 10.0, 1000.0, 3999.0}) {
    EXPECT_NEAR(curve.measured_dn(curve.linear_dn(measured)), measured, kRounding_dn);
    constexpr double kStep_dn = 1e-3;
    const double by_difference =
        (curve.linear_dn(measured + kStep_dn) - curve.linear_dn(measured - kStep_dn)) /
        (2.0 * kStep_dn);
    EXPECT_NEAR(curve.slope(measured), by_difference, 1e-8);
  }
  const ResponseCurve falling{4000.0, -0.9, 0.0};
  EXPECT_THROW(falling.measured_dn(3500.0), NumericalError);
}

}  // namespace
}  // namespace gonio::instrument
