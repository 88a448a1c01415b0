#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "gonio/calibration/geometry/peak_scan.h"
#include "gonio/calibration/result/calibrated_rig.h"

namespace gonio::calibration::geometry {

struct PeakFitOptions {
  Eigen::Vector3d point_in_sample_mm = Eigen::Vector3d::Zero();  ///< as for fit_peak
  /// What the rig itself is uncertain by: rigs that differ from the one given by one standard
  /// deviation of an independent error each (one_sigma_rigs()). The result follows half an error of
  /// the lamp arm's zero, say, and its covariance says so.
  std::vector<CalibratedRig> one_sigma_rigs;
  Angle min_arm_separation = Angle::from_degrees(10.0);  ///< between two peaks at least
  /// Peaks that contradict each other by more (rms per axis) are refused.
  Angle max_disagreement = Angle::from_degrees(0.1);
};

/// What the zeros of azimuth and tilt were off by.
struct ZeroOffsets {
  rig::RigDescription rig;  ///< with the offsets of the two links corrected
  Angle azimuth;            ///< added to the offset of the azimuth link
  Angle tilt;
  Eigen::Matrix2d covariance;  ///< of (azimuth, tilt), rad^2
  double chi2_per_dof = 0.0;   ///< of the peaks about the result
  /// What each peak still is off by, as slopes; against the arm it shows the arm's eccentricity.
  std::vector<Eigen::Vector2d> residuals;
  /// Those of the options with the zeros that the peaks give them, then the rig found with its
  /// zeros off by what the peaks themselves leave open: independent errors of all that is known by
  /// now.
  std::vector<CalibratedRig> one_sigma_rigs;
};

/// Zeros from peaks of a flat mirror at several lamp-arm angles, by weighted least squares.
///
/// `found`         The rig so far, and its lens, which is passed on.
/// `u_mount_tilt`  Standard deviation of the mirror's tilt in its mount about each axis. Like an
///                 error of the zeros to peaks of one kind; peaks with the mirror turned (half of
///                 them, see Peak::turned) tell it apart.
/// Threads         Any.
/// Errors          StepRefused: no LA-2, fewer than two peaks, arm angles too near, peaks that
///                 contradict each other.
ZeroOffsets fit_zero_offsets(const CalibratedRig& found, std::span<const Peak> peaks,
                             Angle u_mount_tilt, const PeakFitOptions& options = {});

/// How a sample's normal leans in its mount.
struct MountNormal {
  /// The normal is z turned by the rotation vector (tilt_x, tilt_y, 0), sample frame.
  Angle tilt_x;
  Angle tilt_y;
  Eigen::Matrix2d covariance;  ///< of (tilt_x, tilt_y), rad^2, as far as the peaks know
  double chi2_per_dof = 0.0;   ///< of the peaks about the result
};

/// The normal of a glossy sample from peaks of its own highlight at two lamp-arm angles or more.
/// Errors as fit_zero_offsets.
MountNormal fit_mount_normal(const rig::RigDescription& rig, std::span<const Peak> peaks,
                             const PeakFitOptions& options = {});

}  // namespace gonio::calibration::geometry
