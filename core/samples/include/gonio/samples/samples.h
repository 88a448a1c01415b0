#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "gonio/brdf/brdf_model.h"
#include "gonio/brdf/directions.h"
#include "gonio/files/atomic_file.h"

namespace gonio::samples {

/// One measured BRDF value at one direction, with its uncertainty (k = 1).
struct Sample {
  /// Measured, never commanded. phi_h only tells how the samples of a pose lie to each other.
  brdf::HalfDiff direction;
  brdf::Rgb value_per_sr = brdf::Rgb::Zero();     ///< may be negative: dark after subtraction
  brdf::Rgb sigma_per_sr = brdf::Rgb::Zero();     ///< independent of all other samples
  brdf::Rgb u_common_per_sr = brdf::Rgb::Zero();  ///< common to all samples of the same pose
  Angle u_theta_h, u_theta_d, u_phi_d;            ///< common to all samples of the same pose
  /// Of the surface's normal, about each of two axes in the surface; common to all samples of the
  /// same pose. Comes on top of the three before. A tilt that stays for a whole session is told as
  /// one of every pose: the solver does not know that they are the same.
  Angle u_tilt;
  Angle kernel;   ///< angular spread (1 sd of theta_h) the value was averaged over
  int pose = -1;  ///< samples with the same id are sub-samples of one frame; -1: each its own
  /// Which part of the sample: number of the sub-sample in its frame's grid, row by row, the same
  /// in every frame. -1: not known.
  int spot = -1;
  std::string flags;  ///< empty, or words separated by ';': saturated, dark, clipped ...
  std::vector<std::string> extra;  ///< text of SampleSet::extra_columns; empty: all blank
};

/// Samples of one material. `scale` is what the values are in.
struct SampleSet {
  std::vector<Sample> samples;
  brdf::RadiometricScale scale = brdf::RadiometricScale::si;
  /// One line each: columns this version does not know, a file that names no radiometric scale.
  std::vector<std::string> warnings;
  std::vector<std::string> extra_columns;  ///< unknown columns, kept as text for a rewrite
  std::vector<std::string> comments;       ///< '#' lines but the scale's, kept for a rewrite
};

/// Reads samples.csv (docs/formats.md): header line with theta_h_deg,theta_d_deg,phi_d_deg,r,g,b
/// and optional columns in any order; '#' comment lines, one of which may be
/// `# radiometric_scale = si|merl` (absent: si, with a warning).
///
/// Range    theta_h, theta_d in [0, 90] deg, phi_d in [-180, 180] deg (180 is legal and kept);
///          values within 1e12 of 0, uncertainties in [0, 1e12], 1/sr.
/// Throws   DataFormatError (path, "line N, column NAME", found, expected): missing columns, a row
///          of the wrong length, a number that is none or not finite, a direction below the horizon
///          or out of range, no samples at all, negative sigma.
SampleSet read_samples(const std::filesystem::path& path);

/// Writes them so that read_samples() returns the same numbers to the last bit; optional columns
/// that say nothing (all zero, all -1, all empty) are left out.
///
/// Throws   std::invalid_argument ("sample N: ...") for what read_samples() would refuse, before
///          anything is written; FileError when the file exists (Overwrite::No) or cannot be
///          written.
void write_samples(const std::filesystem::path& path, const SampleSet& set,
                   files::Overwrite overwrite = files::Overwrite::No);

/// A list of directions to measure, as people and plans write it.
struct Direction {
  brdf::HalfDiff angles;
  int line = 0;  ///< where it stood in the file; 0 if made in memory
};

/// What to do with a listed direction below the horizon: refuse the file, or hand it on to a
/// caller that names and drops it itself.
enum class BelowHorizon { Refuse, Keep };

/// Reads the first three columns (theta_h_deg,theta_d_deg,phi_d_deg) of a directions, plan or
/// samples CSV; other columns are ignored.
/// Throws DataFormatError as above; also for duplicates (the same direction twice, phi_d = 180
/// and -180 being the same).
std::vector<Direction> read_directions(const std::filesystem::path& path,
                                       BelowHorizon below_horizon = BelowHorizon::Refuse);

}  // namespace gonio::samples
