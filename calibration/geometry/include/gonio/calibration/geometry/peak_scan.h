#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <span>

#include "gonio/rig/rig_description.h"
#include "gonio/units/angle.h"

namespace gonio::calibration::geometry {

/// Brightness of a mirror or of a glossy sample at one pose.
struct PeakSample {
  rig::Joints joints;   ///< readings, every axis approached from the same side
  double signal = 0.0;  ///< of one spot of the sample, above dark; any unit
  double sigma = 0.0;   ///< its standard uncertainty, same unit
};

struct PeakOptions {
  Eigen::Vector3d point_in_sample_mm = Eigen::Vector3d::Zero();  ///< the spot, sample frame
  /// Standard deviation of where an axis comes to stand about its reading.
  Angle u_joint;
  double min_fraction = 0.2;     ///< of the brightest: darker samples are left out
  std::size_t min_samples = 12;  ///< that remain
  double max_rms_log = 0.2;      ///< of ln(signal) about the paraboloid
};

/// Where a highlight is brightest, for one angle of the lamp arm.
struct Peak {
  rig::Joints joints;  ///< readings at the peak
  /// The half vector there in the sample's frame, as (h_x / h_z, h_y / h_z): (0, 0) where rig and
  /// sample are as the rig says. It is the slope of the true normal in the sample's frame.
  Eigen::Vector2d slope;
  Eigen::Matrix2d covariance;  ///< of slope
  double chi2_per_dof =
      0.0;  ///< of ln(signal) about the paraboloid; the covariance is scaled by it
  /// The mirror was turned by half a turn in its mount (fit_zero_offsets); set by the caller.
  bool turned = false;
};

/// The peak of a scan in azimuth and tilt (7 x 7, say) at a fixed lamp arm.
///
/// Method   signal r^2 cos theta_o follows the distribution D of facet normals alone. Its
/// logarithm,
///          or a power of it between 0 and -1 where that fits better, is fitted by a paraboloid
///          over the slopes of the half vector in the sample's frame, where a highlight is
///          symmetric (exact for Beckmann by ln D, for GGX by D^(-1/2)). Over the joints it is
///          skewed, and without the cosine the peak of a lobe of slope m moves by m^2/2 tan
///          theta_o: 0.1 deg for m = 0.1 at 20 deg.
/// Nominal  `rig` may be off by some degrees: only the peak's slope says by how much.
/// Threads  Any.
/// Errors   StepRefused: no LA-2, joints or signals that are no numbers, not one joint per axis, a
///          lamp arm that moved, too few bright samples, samples on a line, no maximum, a peak at
///          the edge of the scan (the message says where to look), more than one peak.
/// Source   Torrance and Sparrow, JOSA 57, 1967 (D of the half vector; n || h at the maximum);
///          Walter et al., "Microfacet Models for Refraction", EGSR 2007, eq. 25 and 33.
Peak fit_peak(const rig::RigDescription& rig, std::span<const PeakSample> scan,
              const PeakOptions& options = {});

}  // namespace gonio::calibration::geometry
