#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "gonio/samples/samples.h"

namespace gonio::quality {

/// Is the sample the same all over? A BRDF follows the directions; what stays with a place of the
/// sample over all poses is the sample's own: a gradient, a spot, a scratch, or a curved surface.
struct HomogeneityCheck {
  /// False with fewer than eight poses of two or more known spots: chance cannot be ruled out.
  bool applicable = false;
  int poses = 0;
  /// How often an even sample shows as much by chance.
  double p_value = 1.0;
  /// Share by which the places differ, rms over spots and channels, what noise adds taken off.
  double rms = 0.0;
  /// Per spot, by number: mean deviation from the sample's mean, all channels together; 0 where
  /// nothing is known.
  std::vector<double> pattern;
  bool passed =
      true;  ///< p_value > `false_alarm_rate` or rms < `least_rms`; also if not applicable
};

/// Residuals ln(value / fit) of each pose, less their mean, are averaged spot by spot over the
/// poses. Whether that is more than chance is told by turning the signs of whole poses at random:
/// what follows the directions has no sign of its own from pose to pose, whatever its shape within
/// a patch; what stays with the sample has.
///
/// `fitted_per_sr`     n x 3: basis::Fit::fitted_per_sr of the same samples.
/// `false_alarm_rate`  Of `passed` on even samples; at least 1/128 can be told from eight poses.
/// `least_rms`         Smaller differences never count: they cost less than other errors.
/// Seed                Beyond eleven poses signs are drawn 1,023 times.
/// Errors              std::invalid_argument when the lengths differ.
HomogeneityCheck check_homogeneity(const samples::SampleSet& set,
                                   const Eigen::MatrixXd& fitted_per_sr,
                                   double false_alarm_rate = 0.01, double least_rms = 0.01,
                                   std::uint64_t seed = 1);

}  // namespace gonio::quality
