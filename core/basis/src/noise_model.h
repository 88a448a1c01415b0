#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "gonio/basis/basis.h"
#include "gonio/basis/reconstruct.h"
#include "gonio/samples/samples.h"

namespace gonio::basis::detail {

/// Where the samples lie in the basis; does not depend on their values or channel.
struct SampleRows {
  Eigen::MatrixXd a;       ///< n x k, interpolated rows of Q
  Eigen::VectorXd mean;    ///< n
  Eigen::VectorXd weight;  ///< n

  /// Rows a whole uncertainty to either side along one angle or tilt, for the slope of the fit.
  struct Shifted {
    bool used = false;  ///< some sample has an uncertainty of this kind
    Eigen::MatrixXd a_plus, a_minus;
    Eigen::VectorXd mean_plus, mean_minus, weight_plus, weight_minus;
    Eigen::VectorXd factor;  ///< n: uncertainty over distance of the two; 0 where there is none
    Eigen::VectorXd
        both_sides;  ///< n: 1 where a tilt goes both ways, so that its curvature is known
  };
  std::array<Shifted, 5> shifted;  ///< theta_h, theta_d, phi_d, tilt about x, about y

  std::vector<std::vector<Eigen::Index>> poses;  ///< two samples or more that share a frame
};

SampleRows look_up(const BasisRows& rows, const samples::SampleSet& set, Eigen::Index components);

/// Samples of one channel in the mapped domain, seen from a fit.
///
/// Covariance R = diag(variance) + sum over poses and columns of common common^T, where a column of
/// `common` is restricted to the samples of one pose.
struct MappedSamples {
  Eigen::VectorXd x;         ///< n
  Eigen::VectorXd variance;  ///< n
  Eigen::MatrixXd common;    ///< n x 6: radiometric, then as SampleRows::shifted
  bool depends_on_fit = false;
};

/// The part of every sample's variance that is no noise: what the basis cannot express.
double model_variance(const Basis& basis, double model_eta);

/// `fitted`  The current fit's BRDF at the samples in 1/sr; empty before the first.
MappedSamples map_samples(const Basis& basis, const SampleRows& rows, const samples::SampleSet& set,
                          int channel, const ReconstructOptions& options,
                          const Eigen::VectorXd& coefficients, const Eigen::VectorXd& fitted);

}  // namespace gonio::basis::detail
