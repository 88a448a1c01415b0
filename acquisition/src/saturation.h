#pragma once

#include <algorithm>
#include <cstdint>

#include "gonio/instrument/instrument.h"

namespace gonio::acquisition {

/// DN as read from which a pixel carries no value: the lowest of what the calibration says, what
/// its full well comes to, and the camera's own level, which the calibration cannot know of
/// (another gain, another mode). `camera_level_dn` 0: the camera does not say.
inline double saturation_level_dn(const instrument::SensorModel& sensor,
                                  std::uint16_t camera_level_dn) {
  // The full well is charge, a DN as read is bent: the curve is known as far as saturation_dn.
  const double range_dn = sensor.saturation_dn - sensor.black_level_dn;
  const double full_well_dn = sensor.gain_dn_per_e * sensor.full_well_e;
  const double calibrated_dn =
      full_well_dn < sensor.response.linear_dn(range_dn)
          ? sensor.black_level_dn + sensor.response.measured_dn(full_well_dn)
          : sensor.saturation_dn;
  return camera_level_dn > 0 ? std::min(calibrated_dn, static_cast<double>(camera_level_dn))
                             : calibrated_dn;
}

}  // namespace gonio::acquisition
