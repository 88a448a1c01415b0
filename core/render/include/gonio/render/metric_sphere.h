#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "gonio/brdf/brdf_table.h"
#include "gonio/render/lighting.h"

namespace gonio::render {

/// Linear RGB per sphere pixel, 3 x pixels, in the order of MetricSphere (rows from the top, pixels
/// from the left); radiance in irradiance units per sr.
using SphereRadiance = Eigen::Array3Xd;

/// The picture that image errors are measured on: an orthographic unit sphere seen along z, 96 x 96
/// pixels over [-1, 1]^2 (values at pixel centres), pixels with x^2 + y^2 < 0.995; per pixel the
/// sum over lights of f cos theta_i E where cos theta_i > 0.01, f of the nearest lattice cell.
///
/// Which cell a pixel reads for a light does not depend on the material, so the list of (cell,
/// factor) is worked out once; a picture is then a sparse matrix times a table: about 10 ms.
///
/// Threads  const members may be called from many threads.
class MetricSphere {
 public:
  static constexpr int kSize = 96;

  /// One light's share of a pixel.
  struct Term {
    std::uint32_t cell;
    float factor;  ///< cos theta_i E
  };

  MetricSphere(MetricLighting lighting, brdf::IndexConvention convention);

  /// The same object for all callers; built at the first call, in about 0.1 s.
  static const MetricSphere& shared(MetricLighting lighting, brdf::IndexConvention convention);

  std::size_t pixel_count() const { return first_.size() - 1; }
  std::span<const Term> terms(std::size_t pixel) const {
    return std::span(terms_).subspan(first_[pixel], first_[pixel + 1] - first_[pixel]);
  }

  /// Invalid cells add nothing.
  /// Throws std::invalid_argument when the table's convention is not this sphere's.
  SphereRadiance render(const brdf::BrdfTable& table) const;

  /// Two tables with the same light: a cell that is invalid in either adds nothing to both, so a
  /// hole in one is not taken for a dark spot.
  std::pair<SphereRadiance, SphereRadiance> render_pair(const brdf::BrdfTable& first,
                                                        const brdf::BrdfTable& second) const;

 private:
  void check(const brdf::BrdfTable& table) const;

  brdf::IndexConvention convention_;
  std::vector<std::size_t> first_;  ///< where each pixel's terms begin; one more than pixels
  std::vector<Term> terms_;
};

/// The factor that brings the 90th percentile of a picture's values (all sphere pixels and
/// channels, linear between ranks) to 0.8. 1 for a picture that is black up to there.
double metric_exposure(const SphereRadiance& picture);

/// What the screen shows of it: radiance times exposure, clipped to [0, 1], power 1/2.2.
SphereRadiance metric_display(const SphereRadiance& picture, double exposure);

}  // namespace gonio::render
