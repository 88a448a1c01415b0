#pragma once

#include <cstdint>
#include <span>

#include "gonio/brdf/brdf_model.h"
#include "gonio/samples/samples.h"

namespace gonio::quality {

/// The part of the sample one frame shows. Camera and lamp stand at finite distance, so across it
/// the directions vary: a frame is a patch of directions, cut into grid x grid equal squares that
/// are sampled at their centres.
struct PatchGeometry {
  double half_width_mm = 0.0;  ///< 0: one point per pose
  int grid = 3;
  double camera_distance_mm = 350.0;
  double lamp_distance_mm = 500.0;
};

/// Errors of a measurement without an instrument; k = 1.
struct SyntheticNoise {
  double relative = 0.0;         ///< independent, per sample and channel
  double common_relative = 0.0;  ///< the same for all samples of a pose, per channel
  Angle normal_tilt;             ///< of the normal about two tangential axes, per pose

  bool any() const { return relative > 0.0 || common_relative > 0.0 || normal_tilt > Angle(); }
};

/// Samples of a known material at nominal directions: f(true direction) (1 + noise). The samples
/// carry the nominal directions and the size of the errors, as a real measurement would, never the
/// draw. Sub-samples of direction i have pose i; those below the horizon are left out.
///
/// `scale`   What the model's numbers are in.
/// `stream`  Tells the draws of one seed apart.
/// Throws    std::invalid_argument: no directions, one below the horizon, negative noise, a grid
///           below 1, a patch without positive distances.
samples::SampleSet synthetic_samples(const brdf::BrdfModel& truth, brdf::RadiometricScale scale,
                                     std::span<const brdf::HalfDiff> directions,
                                     const PatchGeometry& patch = {},
                                     const SyntheticNoise& noise = {}, std::uint64_t seed = 1,
                                     std::uint64_t stream = 0);

}  // namespace gonio::quality
