#pragma once

#include <optional>
#include <string>
#include <vector>

#include "gonio/basis/basis.h"
#include "gonio/basis/reconstruct.h"
#include "gonio/design/pose_extension.h"
#include "gonio/quality/verdict.h"
#include "gonio/samples/samples.h"

/// What to measure next, and when it is enough: decided between two poses of a measurement.
namespace gonio::quality {

/// A score counts as reached when so much more is foreseen: the foreseen score is off by some
/// decibels, and the first of many looks that says "reached" is rather one that says too much.
/// From held-out materials (docs/results.md, "Closed loop").
inline constexpr double kStopMargin_db = 0.5;
/// A pose is an outlier beyond so many times what the middle pose is off by. Of ten held-out
/// points, none is named where none is wrong, half of those that are four times too bright, an
/// eighth of those twice (docs/results.md, "Closed loop"): points chosen to tell different things
/// check each other little.
inline constexpr double kOutlierLimit = 2.5;
/// Fewer measured poses foresee nothing.
inline constexpr int kFewestJudged = 5;
/// A pose in whose place another one is measured is not tried again so near: what made it fail,
/// saturation, darkness, a keep-out, rarely ends within a few degrees.
inline constexpr Angle kKeptAway = Angle::from_degrees(5.0);

/// What a measurement tells so far.
struct Prospect {
  Outlook outlook;
  bool doubtful = false;         ///< is_doubtful(): more poses are asked for
  std::vector<int> outliers;     ///< outlying_poses()
  Eigen::MatrixXd coefficients;  ///< k x 3, of the fit

  /// Whether the foreseen score reaches this one, margin included.
  bool reaches(double psnr_db) const {
    return outlook.expected_psnr_db - kStopMargin_db >= psnr_db;
  }
};

/// Fits the samples and looks at what is foreseen. Empty when nothing can be foreseen: fewer than
/// kFewestJudged poses, or too few training materials (outlook()).
/// Throws  As basis::fit().
std::optional<Prospect> prospect(const basis::Basis& basis, const samples::SampleSet& samples);

/// Poses whose samples lie off the fit by more than `limit` times what those of the middle pose do
/// and by more than `limit` of their own sigmas, by samples::Sample::pose, ascending; empty for
/// fewer than kFewestJudged poses. A sample i without a pose is -1 - i.
std::vector<int> outlying_poses(const samples::SampleSet& samples, const basis::Fit& fit,
                                double limit = kOutlierLimit);

/// Chooses the next pose of a session for its basis and its rig.
///
/// Threads  next() from one at a time; uses all inside.
class NextPose {
 public:
  /// `candidates`  Of the rig; `patch` and `noise` as for choosing its plan. The basis is kept by
  ///               reference.
  NextPose(const basis::Basis& basis, design::PoseCandidates candidates,
           const design::PatchGeometry& patch, const design::PoseNoise& noise);

  /// The pose that leaves the least expected error beside those `kept`, measured or planned, away
  /// from those to `avoid`. Empty when there is none.
  std::optional<brdf::HalfDiff> next(const std::vector<brdf::HalfDiff>& kept,
                                     const std::vector<brdf::HalfDiff>& avoid) const;

  /// What `count` more poses than those kept would add to the score of the training materials'
  /// mean, dB, before noise (quality::forecast()); not below 0.
  double gain_db(const std::vector<brdf::HalfDiff>& kept, int count) const;

 private:
  const basis::Basis& basis_;
  design::PoseCandidates candidates_;
  design::PatchGeometry patch_;
  design::PoseNoise noise_;
  Eigen::MatrixXd importance_;
};

}  // namespace gonio::quality
