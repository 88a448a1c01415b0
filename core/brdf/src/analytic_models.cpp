#include "gonio/brdf/analytic_models.h"

#include <stdexcept>
#include <utility>

#include "parameter_checks.h"

namespace gonio::brdf {

Mixture::Mixture(std::vector<Part> parts) : parts_(std::move(parts)) {
  for (const Part& part : parts_) {
    require_between("weight", part.weight, 0.0, 1e6);
    if (!part.model) throw std::invalid_argument("a mixture needs a model in every part");
  }
}

Rgb Mixture::evaluate_visible(const ShadingGeometry& geometry) const {
  Rgb sum = Rgb::Zero();
  for (const Part& part : parts_) sum += part.weight * part.model->evaluate(geometry);
  return sum;
}

Rgb NonBilateral::evaluate_visible(const ShadingGeometry& g) const {
  // Swapping the directions adds half a turn to phi_d, a mirror flips its sign: sin(2 phi_d) keeps
  // the first and not the second. The sines make it continuous at the poles.
  const double odd = 2.0 * g.sin_phi_d * g.cos_phi_d * g.sin_theta_d * g.sin_theta_h;
  const double even = g.cos_theta_d * g.cos_theta_h;
  return Rgb(0.12 + 0.10 * odd, 0.08 + 0.05 * even - 0.07 * odd, 0.15 - 0.05 * even + 0.04 * odd);
}

}  // namespace gonio::brdf
