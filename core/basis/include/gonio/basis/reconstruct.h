#pragma once

#include <Eigen/Core>
#include <optional>

#include "gonio/basis/basis.h"
#include "gonio/samples/samples.h"

namespace gonio::basis {

enum class Method {
  ridge,   ///< posterior mean with each sample's own noise
  nielsen  ///< as published: eta = 40 for every sample, k = n components, one iteration
};

struct ReconstructOptions {
  Method method = Method::ridge;
  /// A fixed eta = m sigma^2 for every sample; empty: from the samples' own sigma, plus
  /// `model_eta` for what the basis cannot express.
  std::optional<double> eta;
  double model_eta = 0.3;
  int relinearisations = 3;  ///< rounds for dark samples (f w + eps near or below 0)
};

/// Coefficients of one material and how well they explain its samples.
struct Fit {
  Eigen::MatrixXd coefficients;     ///< k x 3
  Eigen::MatrixXd fitted_per_sr;    ///< n x 3, the fit at the samples
  Eigen::MatrixXd standardised;     ///< n x 3 residuals over their prior-free sigma, mapped domain
  double chi2_per_sample = 0.0;
};

/// Solves for one material, per channel: minimises (x - mu - A c)^T R^-1 (x - mu - A c) + m c^T c,
/// R = independent + pose-common + model noise in the mapped domain; angle uncertainty enters R
/// through the slope of the current fit.
/// Throws std::invalid_argument for no samples or a scale other than the basis'; NumericalError.
Fit fit(const Basis& basis, const samples::SampleSet& samples, const ReconstructOptions& options);

/// The whole BRDF of some coefficients; negatives clamped at 0.
brdf::BrdfTable expand(const Basis& basis, const Eigen::MatrixXd& coefficients);

}  // namespace gonio::basis
