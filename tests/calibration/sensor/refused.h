#pragma once

#include <gmock/gmock.h>

#include <string>

#include "gonio/calibration/result/step_refused.h"

namespace gonio::calibration::sensor {

/// The message with which `call` refuses; empty when it does not.
template <typename Call>
std::string refusal(Call&& call) {
  try {
    call();
  } catch (const StepRefused& refused) {
    return refused.what();
  }
  return {};
}

/// How many of `draws` may lie within 2 sigma for a sigma that is right: the 90 to 99 %.
/// A right sigma has 95.4 % +- 1.5 % at 200 draws.
inline void expect_coverage(int inside, int draws) {
  EXPECT_GE(inside, draws * 90 / 100) << "sigma is too small";
  EXPECT_LE(inside, draws * 99 / 100) << "sigma is too large";
}

}  // namespace gonio::calibration::sensor
