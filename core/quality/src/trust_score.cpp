#include "gonio/quality/trust_score.h"

#include <cmath>
#include <cstddef>

#include "gonio/basis/dense_field.h"
#include "gonio/basis/training_set.h"
#include "gonio/design/importance.h"

namespace gonio::quality {

Coverage coverage(const brdf::BrdfTable& truth, const basis::Basis& basis, const basis::Fit& fit,
                  const basis::Uncertainty& bands) {
  const Eigen::MatrixXf known = basis::mapped_values(basis.mapping, truth);
  const Eigen::MatrixXf found = basis::mapped_field(basis, fit.coefficients);
  const Eigen::VectorXf weights = design::importance_weights({0.0});
  Coverage inside;
  double total = 0.0;
  for (Eigen::Index c = 0; c < 3; ++c) {
    for (Eigen::Index i = 0; i < known.rows(); ++i) {
      if (!std::isfinite(known(i, c))) continue;
      const double weight = static_cast<double>(weights[i]);
      const double sigmas = static_cast<double>(std::abs(known(i, c) - found(i, c))) /
                            static_cast<double>(bands.sigma(i, c));
      total += weight;
      if (sigmas <= bands.factor_68) inside.in_68 += weight;
      if (sigmas <= bands.factor_95) inside.in_95 += weight;
    }
  }
  inside.in_68 /= total;
  inside.in_95 /= total;
  return inside;
}

double area_under_roc(std::span<const std::pair<double, bool>> results) {
  double right = 0.0;
  double pairs = 0.0;
  for (const auto& [bad_score, failed] : results) {
    if (!failed) continue;
    for (const auto& [good_score, also_failed] : results) {
      if (also_failed) continue;
      pairs += 1.0;
      right += bad_score < good_score ? 1.0 : (bad_score == good_score ? 0.5 : 0.0);
    }
  }
  return right / pairs;
}

}  // namespace gonio::quality
