#pragma once

#include <cstddef>
#include <functional>
#include <string>

#include "gonio/brdf/brdf_model.h"

namespace gonio::brdf {

/// How far imported values are from reciprocal, read as they were and read as they should not have
/// been: median of |ln f(wi, wo) - ln f(wo, wi)|, 0 for a perfect measurement. A file written under
/// another convention is the more reciprocal when read that way.
///
/// What reciprocity cannot see: a mirror image throughout, light and detector exchanged throughout
/// (both are reciprocal BRDFs themselves), and the scale.
struct ConventionReport {
  double as_read = 0.0;
  double phi_reversed = 0.0;   ///< the azimuth runs the other way when light and detector change
  double holds_f_cos_o = 0.0;  ///< what was read as f is f cos theta_o
  double holds_f_cos_i = 0.0;  ///< what was read as f is f cos theta_i, or f over cos theta_o
  double exchanged = 0.0;      ///< f cos theta_o was divided by, but belongs to exchanged roles
  std::size_t pairs = 0;       ///< compared; 0: nothing could be

  /// "reciprocal within 3.1 % as read (azimuth reversed 4.0 %, ...)".
  std::string text() const;
  /// Which other reading is clearly better (under 0.6 of the asymmetry, by more than 0.01), in one
  /// line; empty when none is.
  std::string warning() const;
};

/// Compares `one_way` (values as read, light from wi) with itself both ways round at fixed pairs of
/// directions between 5 and 75 deg, where `covers` says yes both ways.
ConventionReport check_conventions(const std::function<Rgb(const DirectionPair&)>& one_way,
                                   const std::function<bool(const DirectionPair&)>& covers);

}  // namespace gonio::brdf
