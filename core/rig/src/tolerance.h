#pragma once

#include "gonio/units/angle.h"

namespace gonio::rig {

/// Limits are inclusive: published directions lie on them exactly, up to rounding.
inline constexpr Angle kAngleTolerance = Angle::from_radians(1e-9);

}  // namespace gonio::rig
