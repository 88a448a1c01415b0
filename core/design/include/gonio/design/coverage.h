#pragma once

#include <Eigen/Core>

#include "gonio/basis/basis.h"

namespace gonio::design {

/// A box of the lattice: 15 indices of theta_h and theta_d, 30 of phi_d.
struct LatticeRegion {
  Angle theta_h_from, theta_h_to;
  Angle theta_d_from, theta_d_to;
  Angle phi_d_from, phi_d_to;
};

/// Where a design leaves most open.
struct UncoveredRegion {
  LatticeRegion where;
  double share = 0.0;  ///< of the whole lattice's expected importance-weighted square error
  double rms = 0.0;    ///< expected error there (posterior standard deviation), nepers
};

/// The region with the largest sum of posterior variance times importance, of 6 x 6 x 6 that tile
/// the lattice. Var[x_j] = q_j M q_j^T / m.
///
/// `rows`     n x k, rows of Q at the design's directions.
/// `weights`  One per basis cell (importance_weights()).
/// Throws     std::invalid_argument for shapes that do not fit, eta not above 0.
/// Threads    Uses all; the same bytes with any number. About 0.3 s for k = 80.
UncoveredRegion largest_uncovered_region(const basis::Basis& basis, const Eigen::MatrixXd& rows,
                                         const Eigen::VectorXf& weights, double eta);

}  // namespace gonio::design
