#pragma once

#include <cstdint>
#include <span>

#include "gonio/brdf/brdf_model.h"
#include "gonio/design/near_field.h"
#include "gonio/design/patch_geometry.h"
#include "gonio/samples/samples.h"

namespace gonio::quality {

using design::PatchGeometry;

/// Errors of a measurement without an instrument; k = 1.
struct SyntheticNoise {
  double relative = 0.0;         ///< independent, per sample and channel
  double common_relative = 0.0;  ///< the same for all samples of a pose, per channel
  Angle normal_tilt;             ///< of the normal about two tangential axes, per pose

  bool any() const { return relative > 0.0 || common_relative > 0.0 || normal_tilt > Angle(); }
};

/// Samples of a known material at nominal directions: f(true direction) (1 + noise). The samples
/// carry the nominal directions and the size of the errors, as a real measurement would, never the
/// draw. Sub-samples of direction i have pose i and their number in the patch as spot.
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

/// Samples that near-field shots give: one per lattice cell that a shot's pixels fall into, at
/// their mean direction. `noise.relative` is that of a pixel; shot i has pose i.
///
/// Throws    As synthetic_samples(); also when no shot has a usable pixel.
samples::SampleSet near_field_samples(const brdf::BrdfModel& truth, brdf::RadiometricScale scale,
                                      std::span<const brdf::HalfDiff> shots,
                                      const design::NearFieldSetup& setup,
                                      const SyntheticNoise& noise = {}, std::uint64_t seed = 1,
                                      std::uint64_t stream = 0);

}  // namespace gonio::quality
