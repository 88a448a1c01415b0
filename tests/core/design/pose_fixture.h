#pragma once

#include "gonio/design/pose_exchange.h"

namespace gonio::design {

/// A swap must gain a millionth to be taken, and the candidates' gains are known in single
/// precision to about 1e-5 of the criterion: a fixpoint may miss that much.
inline constexpr double kFixpoint = 5e-5;

inline bool anywhere_above_80_deg(const brdf::HalfDiff& pose) {
  return within(DirectionLimits{}, pose);
}

}  // namespace gonio::design
