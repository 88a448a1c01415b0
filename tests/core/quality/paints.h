#pragma once

#include <cmath>
#include <string>

#include "gonio/basis/training_set.h"
#include "gonio/brdf/brdf_model.h"
#include "gonio/design/published_sets.h"
#include "gonio/quality/synthetic_samples.h"

namespace gonio::quality {

inline constexpr int kMaterials = 24;

/// Numbers in [0, 1) that fill it evenly in several dimensions.
inline double part(int index, double step) { return std::fmod(0.5 + index * step, 1.0); }

/// A coloured body under a gloss: quick to evaluate at a million cells. `swing` lets the colour
/// turn with theta_d, as pearl pigments and thin films do.
class Paint final : public brdf::BrdfModel {
 public:
  explicit Paint(int index, double swing = 0.0)
      : body_(0.02 + 0.25 * part(index, 0.6180339887), 0.02 + 0.25 * part(index, 0.7548776662),
              0.02 + 0.25 * part(index, 0.5698402910)),
        gloss_(0.5 * std::pow(20.0, part(index, 0.8191725134))),
        sharpness_(10.0 * std::pow(40.0, part(index, 0.6710436067))),
        swing_(swing) {}

 private:
  brdf::Rgb evaluate_visible(const brdf::ShadingGeometry& g) const override {
    const double tan_h = g.sin_theta_h / g.cos_theta_h;
    const double fresnel = 0.04 + 0.96 * std::pow(1.0 - g.cos_theta_d, 5);
    brdf::Rgb turned = body_;
    for (Eigen::Index c = 0; c < 3; ++c) {
      const double phase = 9.0 * g.cos_theta_d * (1.0 + 0.4 * static_cast<double>(c));
      turned[c] *= std::exp(swing_ * std::sin(phase));
    }
    return turned + gloss_ * fresnel * std::exp(-sharpness_ * tan_h * tan_h);
  }

  brdf::Rgb body_;
  double gloss_;
  double sharpness_;
  double swing_;
};

inline const basis::Basis& trained() {
  static const basis::Basis made = [] {
    basis::TrainingSet set(brdf::RadiometricScale::si);
    for (int i = 0; i < kMaterials; ++i) set.add({"paint-" + std::to_string(i), "", ""}, Paint(i));
    return basis::train(set, basis::centred_gram(set), 30);
  }();
  return made;
}

inline samples::SampleSet measured(const brdf::BrdfModel& model) {
  SyntheticNoise noise;
  noise.relative = 0.03;
  return synthetic_samples(model, brdf::RadiometricScale::si,
                           design::published_set("nielsen-10").directions, {}, noise);
}

}  // namespace gonio::quality
