#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "gonio/instrument/acceptance_check.h"
#include "gonio/instrument/instrument.h"

namespace gonio::calibration::sensor {

/// One image of a white plane: what was seen and what geometry alone says.
struct FlatImage {
  std::span<const double> signal_dn;  ///< above dark, row-major
  /// Relative radiance towards the pixel up to a constant: lamp intensity * cos theta_i / r^2 *
  /// the white's angular factor. 0 where the pixel does not see the plane.
  std::span<const double> expected;
};

struct FlatFieldOptions {
  bool mosaic = false;  ///< Bayer: each of the 2 x 2 phases has a constant of its own
  std::span<const std::uint8_t> bad_pixels = {};  ///< not 0: left out
  double max_residual = 0.003;                    ///< acceptance, rms
};

struct FlatField {
  instrument::Vignetting vignetting;
  Eigen::Matrix3d covariance;  ///< of v1, v2, v3
  double residual_rms = 0.0;   ///< relative, of means over 16 x 16 px: what the model misses
  /// Relative response of each pixel over V, 1 on average; 0 where no image saw it.
  std::vector<float> pixel_response;
  double pixel_response_rms = 0.0;  ///< of pixel_response - 1: PRNU and remaining noise
  instrument::AcceptanceCheck acceptance;
};

/// Falloff of the lens by field angle and response of the pixels, from images of a white plane in
/// one or more poses.
///
/// Method   signal / expected = C V(q) (1 + prnu), V = 1 + v1 q + v2 q^2 + v3 q^3, with a constant
///          C for every image (the lamp drifts). The pixels' own response is the same in all
///          images, so the covariance takes the images of one pixel as one observation (Liang and
///          Zeger, Biometrika 73, 1986).
/// Threads  Any.
/// Errors   StepRefused: no image, sizes that do not fit the camera, numbers that are none, fewer
///          than 1000 pixels seen, all pixels within a field too small to tell V, a signal that is
///          not positive (lamp off). std::invalid_argument: a mask of another size.
FlatField fit_flat_field(const instrument::CameraModel& camera, std::span<const FlatImage> images,
                         const FlatFieldOptions& options = {});

}  // namespace gonio::calibration::sensor
