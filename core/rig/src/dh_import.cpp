#include "gonio/rig/dh_import.h"

namespace gonio::rig {
namespace {

using Eigen::AngleAxisd;
using Eigen::Isometry3d;
using Eigen::Translation3d;
using Eigen::Vector3d;

Isometry3d about_z(const DhRow& row) {
  return Translation3d(0.0, 0.0, row.d_mm) * AngleAxisd(row.theta.radians(), Vector3d::UnitZ());
}

Isometry3d about_x(const DhRow& row) {
  return Translation3d(row.a_mm, 0.0, 0.0) * AngleAxisd(row.alpha.radians(), Vector3d::UnitX());
}

}  // namespace

Chain chain_from_dh(const std::vector<DhRow>& rows, DhConvention convention,
                    const Isometry3d& world_from_base, const Isometry3d& flange_from_tip) {
  Chain chain;
  Isometry3d pose = world_from_base;
  for (const DhRow& row : rows) {
    // The joint turns about z of the frame in front of its z part: the last frame in the classic
    // convention, the one after this row's x part in the modified.
    if (convention == DhConvention::modified) pose = pose * about_x(row);
    ChainLink link;
    link.axis = row.axis;
    link.direction = pose.linear().col(2);
    link.point_mm = pose.translation();
    link.scale = row.scale;
    link.offset = row.offset;
    link.lead_mm_per_turn = row.lead_mm_per_turn;
    chain.links.push_back(link);
    pose = pose * about_z(row);
    if (convention == DhConvention::classic) pose = pose * about_x(row);
  }
  chain.home_pose = pose * flange_from_tip;
  return chain;
}

}  // namespace gonio::rig
