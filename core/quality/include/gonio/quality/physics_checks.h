#pragma once

#include <cstddef>
#include <vector>

#include "gonio/brdf/brdf_model.h"
#include "gonio/brdf/brdf_table.h"
#include "gonio/samples/samples.h"

/// What any true BRDF obeys, whatever the material: a result or a measurement that does not says
/// that something is wrong, without a truth to compare with.
namespace gonio::quality {

/// Light reflected into all directions over light that falls in from one, per channel.
struct DirectionalAlbedo {
  Angle theta_i;
  brdf::Rgb albedo;
};

/// No surface reflects more light than it receives.
struct EnergyCheck {
  /// False on MERL's own scale, which is about a third of SI: the test has no force there, and
  /// `albedos` is empty.
  bool applicable = false;
  std::vector<DirectionalAlbedo> albedos;  ///< theta_i = 0, 15, 30, 45, 60, 75 deg
  double largest = 0.0;                    ///< over channels and angles
  bool passed = true;                      ///< largest <= 1 + `tolerance`
};

/// `tolerance`  What the data's own uncertainty allows above 1.
/// Accuracy     0.5 % for lobes no narrower than the lattice's first theta_h step.
/// Threads      Uses all; about 0.05 s.
EnergyCheck check_energy(const brdf::BrdfModel& model, brdf::RadiometricScale scale,
                         double tolerance = 0.02);

/// Directional albedo at one angle of incidence, in [0, 90) deg.
brdf::Rgb directional_albedo(const brdf::BrdfModel& model, Angle theta_i);

/// Two samples of the same direction with light and detector exchanged (Helmholtz).
struct ReciprocalPair {
  std::size_t first;  ///< indices into the sample set
  std::size_t second;
  brdf::Rgb ratio;  ///< value of `first` over value of `second`; NaN where that is not positive
  brdf::Rgb z;      ///< difference over its standard uncertainty; NaN without uncertainty
};

/// Swapping light and detector must not change the value. Reciprocity is built into the lattice
/// (phi_d in [0, 180)), so only measured pairs can show a violation, never a reconstructed table.
struct ReciprocityCheck {
  std::vector<ReciprocalPair> pairs;
  double mean_log_ratio = 0.0;  ///< over pairs and channels with a ratio: the systematic part
  double rms_z = 0.0;           ///< about 1 when the uncertainties are true; NaN without any
  double largest_z = 0.0;
  bool passed = true;  ///< rms_z <= `limit`; also true with no pair: see pairs.empty()
};

/// Finds pairs by their measured directions: theta_h, theta_d and phi_d + 180 deg agree as
/// directions within `tolerance`; each sample is used once, nearest pairs first. Samples that share
/// a pose are not paired.
///
/// Uncertainty  Independent and pose-common parts of both samples. With `model` also what its slope
///              makes, angle by angle, of both samples' angle uncertainties and of the distance of
///              the two directions; without it allow for these in `limit` on glossy samples.
/// `model`      About what was measured, in the set's scale: a reconstruction. Null: none.
ReciprocityCheck check_reciprocity(const samples::SampleSet& set,
                                   Angle tolerance = Angle::from_degrees(0.25), double limit = 3.0,
                                   const brdf::BrdfModel* model = nullptr);

/// Cells above the horizon that are valid and zero in at least one channel: where a fit went below
/// zero and was clamped.
std::size_t clamped_cells(const brdf::BrdfTable& table);

}  // namespace gonio::quality
