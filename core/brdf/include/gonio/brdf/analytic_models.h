#pragma once

#include <memory>
#include <vector>

#include "gonio/brdf/brdf_model.h"
#include "gonio/brdf/diffuse_models.h"
#include "gonio/brdf/layered_models.h"
#include "gonio/brdf/microfacet_models.h"

namespace gonio::brdf {

// Every model is reciprocal, non-negative and, with parameters in the stated range, reflects no
// more than it receives; ShiftedGamma and AbcLobe with its own A are fits and leave that to the
// caller. Constructors throw std::invalid_argument for parameters out of range.

/// Weighted sum of models.
class Mixture final : public BrdfModel {
 public:
  struct Part {
    Rgb weight;  ///< >= 0; weights that sum to at most 1 keep the energy of the parts
    std::shared_ptr<const BrdfModel> model;
  };
  explicit Mixture(std::vector<Part> parts);

 private:
  Rgb evaluate_visible(const ShadingGeometry& geometry) const override;

  std::vector<Part> parts_;
};

/// A reciprocal function that is not bilateral (phi_d -> -phi_d changes it), and different in every
/// channel, so that a wrong sign of phi or swapped channels show. A test function, not a material.
class NonBilateral final : public BrdfModel {
 private:
  Rgb evaluate_visible(const ShadingGeometry& geometry) const override;
};

}  // namespace gonio::brdf
