#pragma once

#include "gonio/units/angle.h"

namespace gonio::quality {

/// The band of directions that figures called grazing are taken over: the larger of theta_i and
/// theta_o lies between these, inclusive. Beyond it hardly an instrument reaches.
struct GrazingBand {
  double largest_cosine = cos(Angle::from_degrees(65.0));
  double least_cosine = cos(Angle::from_degrees(85.0));

  /// `cosine`  The smaller of cos theta_i and cos theta_o.
  bool holds(double cosine) const { return cosine <= largest_cosine && cosine >= least_cosine; }
};

}  // namespace gonio::quality
