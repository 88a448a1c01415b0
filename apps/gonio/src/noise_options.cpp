#include "noise_options.h"

namespace gonio::cli {

void add_noise_options(const Command& command, NoiseWords& words) {
  command.number("--noise", words.relative, 0.0, 1.0, "Relative standard deviation per value");
  command.number("--noise-common", words.common_relative, 0.0, 1.0,
                 "Relative standard deviation of what all values of a pose share, per channel");
  command.number("--angle-error", words.tilt_deg, 0.0, 10.0,
                 "Standard deviation of the normal's tilt, degrees per axis");
}

quality::SyntheticNoise synthetic_noise(const NoiseWords& words) {
  return {words.relative, words.common_relative, Angle::from_degrees(words.tilt_deg)};
}

}  // namespace gonio::cli
