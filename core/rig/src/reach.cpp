#include "gonio/rig/reach.h"

#include <Eigen/SVD>
#include <algorithm>
#include <array>

#include "direction_jacobian.h"
#include "gonio/parallel/parallel.h"
#include "gonio/random/distributions.h"
#include "gonio/random/key.h"

namespace gonio::rig {
namespace {

namespace lattice = brdf::lattice;

constexpr std::size_t kCellsPerBlock = 1 << 14;
constexpr std::size_t kReasons = static_cast<std::size_t>(Reason::PathBlocked) + 1;
constexpr std::uint64_t kRankSamples = 200;
constexpr double kRankTolerance = 1e-9;  // of the largest singular value

using Counts = std::array<std::size_t, kReasons + 1>;  // the last: reachable

}  // namespace

ReachStatistics reach_statistics(const Inverse& inverse) {
  const std::vector<std::uint32_t>& cells = lattice::cells_above_horizon();
  ReachStatistics statistics;
  statistics.valid_cells = cells.size();
  statistics.reachable.assign(lattice::kCells, 0);
  const Counts counts = parallel::reduce_blocks(
      std::size_t{0}, cells.size(), kCellsPerBlock, Counts{},
      [&](std::size_t begin, std::size_t end) {
        Counts part{};
        for (std::size_t i = begin; i < end; ++i) {
          const auto reason =
              inverse.refusal_reason(lattice::angles_of(lattice::index_from_cell(cells[i])));
          if (!reason) statistics.reachable[cells[i]] = 1;
          ++part[reason ? static_cast<std::size_t>(*reason) : kReasons];
        }
        return part;
      },
      [](Counts& total, Counts&& part) {
        for (std::size_t k = 0; k < total.size(); ++k) total[k] += part[k];
      });
  statistics.reachable_cells = counts[kReasons];
  for (std::size_t k = 0; k < kReasons; ++k) {
    if (counts[k] > 0) statistics.refused[static_cast<Reason>(k)] = counts[k];
  }
  return statistics;
}

int reach_rank(const RigDescription& rig, std::uint64_t seed) {
  rig.validate();
  int rank = 0;
  for (std::uint64_t i = 0; i < kRankSamples && rank < 3; ++i) {
    const random::Key key = random::make_key(seed, "rig.reach_rank", i);
    Joints joints;
    for (std::size_t k = 0; k < rig.axes.size(); ++k) {
      const Axis& axis = rig.axes[k];
      joints.push_back(axis.min + (axis.max - axis.min) * random::uniform(key, k));
    }
    const DirectionJacobian at = direction_jacobian(rig, joints);
    Eigen::Matrix3Xd jacobian(3, at.d_wi.cols());
    jacobian.row(0) = at.d_wi.row(2);
    jacobian.row(1) = at.d_wo.row(2);
    jacobian.row(2) = at.pair.wi.transpose() * at.d_wo + at.pair.wo.transpose() * at.d_wi;
    const Eigen::VectorXd singular = Eigen::JacobiSVD<Eigen::MatrixXd>(jacobian).singularValues();
    const auto above = (singular.array() > kRankTolerance * singular[0]).count();
    if (singular[0] > 0.0) rank = std::max(rank, static_cast<int>(above));
  }
  return rank;
}

}  // namespace gonio::rig
