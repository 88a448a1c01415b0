#pragma once

#include <Eigen/Core>
#include <string_view>

#include "gonio/brdf/directions.h"
#include "gonio/brdf/shading_geometry.h"

namespace gonio::brdf {

/// Red, green, blue in this order: BRDF in 1/sr (no cosine), radiance or reflectance by context.
using Rgb = Eigen::Array3d;

/// What radiometric unit the numbers of a BRDF are in. MERL as distributed is about a third of SI
/// (teflon comes out at pi f = 0.33), so the scale travels with every table, basis and sample file.
enum class RadiometricScale { si, merl };

/// What a value of the MERL database has to be multiplied by to be in SI, as good as is known: the
/// database gives polytetrafluoroethylene (teflon) pi f = 0.34 near the normal, whose reflectance
/// is 0.93 to 0.95. Used only where a user asks for files of both scales to be brought together.
constexpr double kMerlToSi = 2.75;

std::string_view to_string(RadiometricScale scale);
RadiometricScale radiometric_scale_from_string(std::string_view name);

/// An isotropic BRDF that can be evaluated for any pair of directions.
///
/// Models   Implement one of the two virtuals, each of which falls back on the other: a formula in
///          half/difference angles evaluate_visible(), everything else evaluate().
/// Threads  evaluate() is const and may be called from many threads.
class BrdfModel {
 public:
  virtual ~BrdfModel() = default;

  /// BRDF in 1/sr; 0 when either direction is at or below the horizon. Throws
  /// std::invalid_argument when a direction is not of unit length. Virtual for models that have a
  /// shorter way than through a ShadingGeometry.
  virtual Rgb evaluate(const DirectionPair& pair) const {
    if (pair.wi.z() <= 0.0 || pair.wo.z() <= 0.0) return Rgb::Zero();
    return evaluate_visible(shading_geometry(pair));
  }

  /// The same from a geometry that is already at hand: use this to evaluate many models at one
  /// place, or one model along a lattice.
  Rgb evaluate(const ShadingGeometry& geometry) const {
    return geometry.above_horizon() ? evaluate_visible(geometry) : Rgb::Zero();
  }

 protected:
  BrdfModel() = default;
  BrdfModel(const BrdfModel&) = default;
  BrdfModel& operator=(const BrdfModel&) = default;

 private:
  /// Both directions lie above the horizon.
  virtual Rgb evaluate_visible(const ShadingGeometry& geometry) const {
    return evaluate(directions_from_half_diff(geometry.half_diff));
  }
};

}  // namespace gonio::brdf
