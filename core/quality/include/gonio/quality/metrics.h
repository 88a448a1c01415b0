#pragma once

#include <cstddef>

#include "gonio/basis/log_mapping.h"
#include "gonio/brdf/brdf_table.h"
#include "gonio/render/metric_sphere.h"

namespace gonio::quality {

/// How far a found BRDF is from the true one, cell by cell. All over the cells that lie above the
/// horizon and are valid in both tables; `g` is the mapping ln(f w + eps).
struct LatticeError {
  /// sqrt(sum W (g(found) - g(truth))^2 / (3 sum W)) over cells and channels,
  /// W = sin(th) sqrt(th) sin(td) cos(td) cos theta_i cos theta_o: the primary figure.
  double weighted_log_rmse = 0.0;
  /// Mean of g(found) - g(truth) under the same W: below 0 means too dark.
  double weighted_log_bias = 0.0;
  /// RMSE and mean of g(found) - g(truth) over cells with max(theta_i, theta_o) in [65, 85] deg,
  /// unweighted. NaN when there are none.
  double grazing_log_rmse = 0.0;
  double grazing_log_bias = 0.0;
  /// Plain, in 1/sr. Says next to nothing about looks; kept because the literature quotes it.
  double raw_rmse_per_sr = 0.0;
  std::size_t cells = 0;          ///< compared
  std::size_t grazing_cells = 0;  ///< of these, in the grazing ring
  std::size_t only_in_truth = 0;  ///< above the horizon and valid in the truth alone
  std::size_t only_in_found = 0;
};

/// How far two pictures of the metric sphere are from each other on the screen.
struct PictureError {
  double psnr_db = 0.0;       ///< over sphere pixels and channels, peak 1; infinite when equal
  double mean_delta_e = 0.0;  ///< CIEDE2000 over the same pixels, sRGB primaries, D65
};

/// Everything that is quoted about a reconstruction.
struct Comparison {
  LatticeError lattice;
  PictureError lighting_a;  ///< what "PSNR" means unless said otherwise
  PictureError lighting_b;
};

/// Throws   std::invalid_argument when the tables' index conventions or radiometric scales differ
///          (the same cell would mean two things), or when no cell is valid in both.
/// Threads  Uses all; the same figures with any number of them. About 0.2 s.
/// Source   docs/conventions.md, "Errors"; Sharma et al. 2005 for the colour difference.
Comparison compare(const brdf::BrdfTable& truth, const brdf::BrdfTable& found,
                   const basis::LogMapping& mapping = {});

/// The parts of it.
LatticeError lattice_error(const brdf::BrdfTable& truth, const brdf::BrdfTable& found,
                           const basis::LogMapping& mapping = {});
PictureError picture_error(const brdf::BrdfTable& truth, const brdf::BrdfTable& found,
                           render::MetricLighting lighting);
/// From pictures already at hand; the exposure is the truth's.
PictureError picture_error(const render::SphereRadiance& truth,
                           const render::SphereRadiance& found);

}  // namespace gonio::quality
