#pragma once

#include <string>

#include "gonio/acquisition/guarded_devices.h"

namespace gonio::acquisition {

/// A home delta up to here is how well a home mark is found again (0.002 deg each time) and how
/// finely an encoder counts; above it is reported.
inline constexpr Angle kUsualHomeDelta = Angle::from_degrees(0.01);
/// Above here steps were lost: points since the axis was last found in order are not trusted.
inline constexpr Angle kLargestHomeDelta = Angle::from_degrees(0.03);
/// An axis this far off after an outage was on its way when the session ended, or was turned since:
/// what its count was worth before cannot be told from it.
inline constexpr Angle kWasOnItsWay = Angle::from_degrees(1.0);

/// What homing says of one axis' count.
struct HomeDelta {
  std::string text;       ///< for the note
  std::string lost;       ///< what was found wrong; empty: nothing
  bool compared = false;  ///< it is known whether the count was right
};

/// `believed`: where the axis said it stood before the first of these homings. `after_outage`: the
/// axis may have been on its way then.
HomeDelta home_delta(const std::string& axis, const HomingEvidence& evidence, Angle believed,
                     bool after_outage);

}  // namespace gonio::acquisition
