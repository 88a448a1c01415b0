#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <string_view>

#include "gonio/basis/basis.h"
#include "gonio/basis/dense_field.h"
#include "gonio/samples/samples.h"

namespace gonio::basis {

/// The eta of Nielsen et al. 2015, at which the published metric (design::xu_metric()) is quoted
/// too.
constexpr double kPublishedEta = 40.0;

enum class Method {
  automatic,  ///< ridge and kernels of several strengths, weighed by leave-one-out evidence
  ridge,      ///< posterior mean with each sample's own noise
  kernel,     ///< ridge plus a kernel of one fixed strength
  nielsen     ///< as published: kPublishedEta for every sample, k = n components, one iteration
};

std::string_view to_string(Method method);
/// Throws std::invalid_argument naming the methods that exist.
Method method_from_string(std::string_view name);

struct ReconstructOptions {
  Method method = Method::automatic;
  /// A fixed eta = m sigma^2 for every sample; empty: from the samples' own sigma, plus
  /// `model_eta` for what the basis cannot express.
  std::optional<double> eta;
  /// m times the variance of what the basis cannot express (nepers^2), per sample. 1 is best or
  /// equal for points and for patches of nine (45 held-out MERL materials, ten chosen poses, 3 %
  /// noise): 35.7 and 37.3 dB, against 35.7 and 37.2 at 0.3, 35.4 and 37.2 at 3.
  double model_eta = 1.0;
  int relinearisations = 3;  ///< rounds for dark samples (f w + eps near or below 0) and slopes
};

/// How a measurement looks beside the training materials, and each of these beside the others, as
/// if it had been measured by the same samples without its own and its siblings' rows in the basis.
/// What the verdict and the bands are calibrated on.
struct Likeness {
  /// m x 3, mean square difference (nepers^2) of a channel's samples from those of a training row,
  /// less what noise adds.
  Eigen::MatrixXd distance;
  Eigen::MatrixXd row_distance;  ///< m x m, the same between training rows
  /// chi^2 per value of the samples against the prior, as innovation_chi2_per_sample but after one
  /// factor common to all channels and samples (prior: 1 neper) is taken out.
  double innovation = 0.0;
  /// chi^2 per value of what is left of a training material's samples when it is predicted from
  /// them without its own group's rows: what chi2_per_sample is to the measurement. By the green
  /// channel's covariance, plus what the noise of all channels leaves in the residuals of the
  /// linear solve.
  Eigen::VectorXd left_out_chi2;
  /// One per training material, what `innovation` is to the measurement: by the green channel's
  /// covariance, plus what the noise of all channels is expected to add to `innovation`.
  Eigen::VectorXd left_out_innovation;
};

/// Coefficients of one material and how well they explain its samples.
struct Fit {
  Eigen::MatrixXd coefficients;   ///< k x 3; components a method does not use are 0
  Eigen::MatrixXd fitted_per_sr;  ///< n x 3, the fit at the samples
  Eigen::MatrixXd standardised;   ///< n x 3 residuals over their prior-free sigma, mapped domain
  double chi2_per_sample = 0.0;   ///< r^T R^-1 r / (3 n) of the residuals r
  /// y^T (R + A A^T/m)^-1 y / (3 n) of y = x - mu: about 1 when the material is like the training
  /// ones and the noise as stated, large when it is outside their span.
  double innovation_chi2_per_sample = 0.0;
  /// Share of the kernels in the result: 0 for ridge, near 0 where the linear prior did better on
  /// training materials that look like this one.
  double kernel_share = 0.0;
  /// m x k, of `kernel` and `automatic`: what is left of each training row, as coefficients, when
  /// it is predicted the same way from samples like these without its own group. Holds for the
  /// green channel's noise. Empty for the other methods.
  Eigen::MatrixXd left_out_residuals;
  /// k x k per channel, of `kernel` and `automatic`: covariance of the coefficients by the samples'
  /// stated noise, through the linear part of the solve. With a fixed eta only dark samples state
  /// noise.
  std::array<Eigen::MatrixXd, 3> noise_covariance;
  Likeness likeness;  ///< of `kernel` and `automatic`
};

/// Solves for one material, per channel.
///
/// ridge    Minimises (x - mu - A c)^T R^-1 (x - mu - A c) + m c^T c: the posterior mean for the
///          prior c ~ N(0, I/m).
/// kernel   The same in dual form plus a term for likeness beyond the linear: training rows whose
///          values at the samples come near the measured ones count more. The result stays a
///          combination of training rows.
/// auto     Several strengths of the kernel, none among them, at two model noises; each is weighed
///          by how well it predicts the training materials that look like this one without their
///          own rows and their siblings'. Training materials that the others explain badly at the
///          samples' directions count less (row_prior.h); the noise's covariance and `likeness` are
///          those of the plain prior, on which bands and verdict were calibrated.
/// R        Mapped domain: diag(sigma_x^2 + model_eta/m), and for the samples of one pose what they
///          share: u_common, and the error of each angle times the slope of the current fit along
///          it (a pose has one position, whatever the number of its sub-samples); likewise the tilt
///          of the normal about two axes, which moves the sub-samples' directions each its own way.
///          With options.eta: eta/m on the diagonal; dark samples add their own sigma and u_common,
///          nothing else does.
/// Dark     A sample with f w + eps below three of its own sigmas (or below eps/2) has no usable
///          logarithm: it enters linearised at the fit, x = g(f^) + g'(f^)(f - f^), f^ kept within
///          three sigmas of the sample. Without relinearisations, as in `nielsen`, or without any
///          sigma, negative values count as 0.
/// Throws   std::invalid_argument for no samples, values that are not finite, a direction below the
///          horizon, options out of range or a scale other than the basis'; NumericalError.
Fit fit(const Basis& basis, const samples::SampleSet& samples,
        const ReconstructOptions& options = {});

}  // namespace gonio::basis
