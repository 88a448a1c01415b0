#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <limits>
#include <span>
#include <stop_token>
#include <vector>

#include "gonio/basis/basis.h"
#include "gonio/design/pose_information.h"
#include "gonio/design/search.h"

namespace gonio::design {

/// How a flat sample is photographed from near, every pixel a direction of its own.
struct NearFieldSetup {
  Angle field_of_view = Angle::from_degrees(25.0);  ///< of the square image, edge to edge
  int image_px = 256;                               ///< along one edge
  double camera_distance_mm = 350.0;                ///< from the sample's centre
  double lamp_distance_mm = std::numeric_limits<double>::infinity();  ///< infinite: directional
  double sample_half_width_mm = std::numeric_limits<double>::infinity();
  Angle theta_max = Angle::from_degrees(88.0);  ///< of light and view at a pixel that is used

  /// Throws std::invalid_argument naming the field.
  void validate() const;
};

/// The pixels of one shot whose directions fall into one lattice cell.
struct NearFieldBin {
  brdf::HalfDiff direction;  ///< mean over the pixels, phi_d in [0, 180), phi_h = 0
  int pixels = 0;
};

/// What one shot shows. The camera looks at the sample's centre with its x axis level.
struct NearFieldView {
  std::vector<NearFieldBin> bins;  ///< by lattice cell
  std::size_t usable_pixels = 0;   ///< of image_px^2
};

/// `centre`  The direction the image's centre sees; phi_h is ignored.
/// Throws std::invalid_argument for a setup out of range, a centre below the horizon.
NearFieldView near_field_view(const brdf::HalfDiff& centre, const NearFieldSetup& setup);

/// Half width of the smallest sample that keeps `share` of the pixels an infinite one makes usable.
/// 0 when there are none.
double needed_half_width_mm(const brdf::HalfDiff& centre, const NearFieldSetup& setup,
                            double share);

/// Information of a shot about the coefficients in units of their prior (k x k): A^T R^-1 A / m
/// with R = diag(independent^2 / pixels + model_eta / m) + common^2 1 1^T over its bins.
Eigen::MatrixXd near_field_information(const basis::BasisRows& rows, const NearFieldView& view,
                                       const PoseNoise& noise);

/// tr(K M) / m as expected_error(), of the sum of some shots' information.
double near_field_error(const basis::BasisRows& rows, const Eigen::MatrixXd& importance,
                        std::span<const brdf::HalfDiff> shots, const NearFieldSetup& setup,
                        const PoseNoise& noise);

struct NearFieldOptions {
  int shots = 2;
  int starts = 20;
  PoseNoise noise;
  double step_deg = 5.0;  ///< of the grid of poses (pose_grid())
  int refinements = 2;    ///< halvings of the step around the best, 0 to 6
  int design_px = 32;     ///< image edge of the search: the lattice is hardly finer
  Angle theta_max = Angle::from_degrees(80.0);  ///< of light and view at the centre
  std::uint64_t seed = 1;

  /// Throws std::invalid_argument naming the field.
  void validate() const;
};

struct NearFieldDesign {
  std::vector<brdf::HalfDiff> shots;
  double value = 0.0;    ///< near_field_error() of them at design_px
  bool finished = true;  ///< false: stopped on request, the best so far
  int starts = 0;        ///< that ran to their end
};

/// Chooses shots by alternating exact minimisation: all but one are held, the best of all poses
/// takes its place, in turn until nothing changes; from random starts. The information of every
/// pose is computed once. At the end the step is halved around the best.
///
/// Memory   4 bytes k (k + 1) / 2 per pose: 100 MB at 5 deg, k = 80.
/// Stop     Between passes: the best so far, or the first start's random shots.
/// Determinism  The same bytes for the same seed, whatever the number of threads.
/// Errors   std::invalid_argument: options, setup, an importance that does not fit the basis.
/// Source   Xu, Nielsen, Yu, Jensen, Ramamoorthi, "Minimal BRDF Sampling for Two-Shot Near-Field
///          Reflectance Acquisition", ACM TOG 35(6), 2016 (the idea of two shots; they search
///          another criterion at random).
NearFieldDesign choose_shots(const basis::Basis& basis, const Eigen::MatrixXd& importance,
                             const NearFieldSetup& setup, const NearFieldOptions& options,
                             const ProgressCallback& progress = {},
                             const std::stop_token& stop = {});

}  // namespace gonio::design
