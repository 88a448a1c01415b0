#pragma once

#include <vector>

#include "gonio/brdf/brdf_model.h"
#include "gonio/units/angle.h"

namespace gonio::sim {

/// How a white tile departs from Lambert's law: a factor by directions, interpolated linearly in
/// the three angles and held constant beyond the outermost nodes.
struct AngularFactor {
  std::vector<Angle> theta_i;    ///< rising, at least one
  std::vector<Angle> theta_o;    ///< rising, at least one
  std::vector<Angle> delta_phi;  ///< between light and detector, 0 .. 180 deg, rising, at least one
  std::vector<double> factor;    ///< [theta_i][theta_o][delta_phi], not negative
};

/// A diffuse white that is not quite Lambertian, as sintered PTFE and Spectralon are not:
/// f = reflectance / pi * factor(theta_i, theta_o, delta_phi).
///
/// Whoever fills the table answers for its reciprocity.
class AngularWhite final : public brdf::BrdfModel {
 public:
  /// `reflectance` in [0, 1]. Throws std::invalid_argument naming what is wrong with the table.
  AngularWhite(const brdf::Rgb& reflectance, AngularFactor factor);

 private:
  brdf::Rgb evaluate_visible(const brdf::ShadingGeometry& geometry) const override;

  brdf::Rgb per_sr_;
  AngularFactor table_;
};

}  // namespace gonio::sim
