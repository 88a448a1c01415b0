#pragma once

#include <vector>

#include "gonio/basis/basis.h"

namespace gonio::design {

/// How well an instrument measures one direction, as known before anything is measured.
///
/// `relative`   Standard uncertainty of a value as a share of it, in [0, 1].
/// `direction`  Standard uncertainty of the half vector's direction and of theta_d, per axis.
struct ExpectedNoise {
  double relative = 0.0;
  Angle direction;
};

/// Candidates::noise for a basis: m times the variance of the mapped value of a training material,
/// averaged over them, at every basis cell:
///
///     m (relative w f / (w f + eps))^2 + direction^2 (m slope(mean)^2 + sum_j slope(Q_j)^2)
///
/// f from the mean of the basis; slopes along theta_h and theta_d between neighbouring cells. A
/// direction error costs most near the mirror direction, where materials fall steepest.
/// Throws   std::invalid_argument for a basis of another lattice, noise out of range.
/// Threads  Uses all; the same bytes with any number. One pass over Q.
std::vector<float> expected_noise(const basis::Basis& basis, const ExpectedNoise& noise);

}  // namespace gonio::design
