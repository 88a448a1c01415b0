#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "gonio/basis/basis.h"

namespace gonio::design {

/// Pictures an error should not be seen in.
struct ImageImportanceOptions {
  int scenes = 6;    ///< each with lights of its own; >= 1
  int pixels = 160;  ///< per scene, evenly at random over the disc of the sphere; >= 8
  int lights = 48;   ///< per scene, over all directions, about half of them seen by a pixel; >= 1
  double spread = 1.5;  ///< of the logarithm of a light's irradiance (normal): few dominate; >= 0
  std::uint64_t seed = 1;

  /// Throws std::invalid_argument naming the field.
  void validate() const;
};

/// How much an error in the coefficients shows in pictures of spheres made of the training
/// materials: K = mean over scenes, pixels and training rows of J^T J, J (1 x k) being the change
/// of a displayed pixel per change of the coefficients. A k x k importance like
/// importance_matrix(); its unit is display values squared.
///
/// Picture  A unit sphere seen along z from afar, exposed so that the 90th percentile of each
///          material's pixels and channels is 0.8, clipped to [0, 1], power 1/2.2. A clipped pixel
///          says nothing: its J is 0. Below 0.001 the slope of the power is taken at 0.001, beyond
///          which linear is no approximation.
/// `basis`         Its mean and components say what the training materials look like in its span.
/// `left_vectors`  U, m x k, three rows per material.
/// Throws          std::invalid_argument: options, shapes.
/// Threads         Uses all; the same bytes with any number. About 0.3 s for k = 80, m = 270.
Eigen::MatrixXd image_importance(const basis::Basis& basis, const Eigen::MatrixXd& left_vectors,
                                 const ImageImportanceOptions& options = {});

/// What counts when directions are chosen, as shares of the whole; solid angle x cosines has the
/// rest.
///
/// `uniform`  See ImportanceOptions.
/// `image`    image_importance(), scaled so that without samples it expects the same error as solid
///            angle x cosines does (equal trace).
struct ImportanceBlend {
  double uniform = 0.0;
  double image = 0.0;

  /// What serves best held out (docs/results.md). Five points leave grazing angles open unless
  /// these count more; patches see enough of them to look after pictures.
  static constexpr ImportanceBlend for_points() { return {0.11, 0.0}; }
  static constexpr ImportanceBlend for_patches() { return {0.1, 0.3}; }
};

/// The importance matrix of a blend. `left_vectors` may be empty when `image` is 0.
/// Throws std::invalid_argument for shares below 0 or above 1 together, or shapes.
Eigen::MatrixXd blended_importance(const basis::Basis& basis, const Eigen::MatrixXd& left_vectors,
                                   const ImportanceBlend& blend,
                                   const ImageImportanceOptions& options = {});

}  // namespace gonio::design
