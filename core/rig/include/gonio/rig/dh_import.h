#pragma once

#include <vector>

#include "gonio/rig/rig_description.h"

namespace gonio::rig {

/// Which of the two Denavit-Hartenberg conventions a table is written in.
///   classic   link transform Rz(theta) Tz(d) Tx(a) Rx(alpha)   (Denavit and Hartenberg 1955)
///   modified  link transform Rx(alpha) Tx(a) Rz(theta) Tz(d)   (Craig, Introduction to Robotics;
///             alpha and a are those of the link before)
enum class DhConvention { classic, modified };

/// One row of a table, at joint angle zero.
struct DhRow {
  double a_mm = 0.0;
  Angle alpha;
  double d_mm = 0.0;
  Angle theta;
  std::size_t axis = 0;           ///< index into RigDescription::axes
  double scale = 1.0;             ///< theta grows by scale * joint ...
  Angle offset;                   ///< ... + offset
  double lead_mm_per_turn = 0.0;  ///< not 0: a slide, d grows instead (ChainLink)
};

/// Converts a table to product of exponentials: the screws are the joints' z axes in the world
/// frame at zero, the home pose is the product of all links.
///
/// `world_from_base`  Where the table's frame 0 stands.
/// `flange_from_tip`  The tool behind the last row.
Chain chain_from_dh(const std::vector<DhRow>& rows, DhConvention convention,
                    const Eigen::Isometry3d& world_from_base = Eigen::Isometry3d::Identity(),
                    const Eigen::Isometry3d& flange_from_tip = Eigen::Isometry3d::Identity());

}  // namespace gonio::rig
