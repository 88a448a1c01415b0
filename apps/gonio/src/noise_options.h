#pragma once

#include "command.h"
#include "gonio/quality/synthetic_samples.h"

namespace gonio::cli {

/// Errors of samples that are made without an instrument, as words of the command line.
struct NoiseWords {
  double relative = 0.0;
  double common_relative = 0.0;
  double tilt_deg = 0.0;
};

/// --noise, --noise-common, --angle-error
void add_noise_options(const Command& command, NoiseWords& words);
quality::SyntheticNoise synthetic_noise(const NoiseWords& words);

}  // namespace gonio::cli
