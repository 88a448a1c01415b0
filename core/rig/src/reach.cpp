#include "gonio/rig/reach.h"

#include <Eigen/SVD>
#include <algorithm>
#include <array>
#include <cmath>

#include "direction_jacobian.h"
#include "gonio/parallel/parallel.h"
#include "gonio/random/distributions.h"
#include "gonio/random/key.h"
#include "numeric_inverse.h"

namespace gonio::rig {
namespace {

namespace lattice = brdf::lattice;

constexpr std::size_t kCellsPerBlock = 1 << 14;
constexpr std::size_t kReasons = static_cast<std::size_t>(Reason::PathBlocked) + 1;
constexpr std::size_t kCandidatesToConfirm = 32;
constexpr std::uint64_t kRankSamples = 200;
constexpr double kRankTolerance = 1e-9;  // of the largest singular value

using Counts = std::array<std::size_t, kReasons + 1>;  // the last: reachable

/// Squared chords of wi and wo between two pairs after the best turn about the normal.
struct Chords {
  double wi = 0.0;
  double wo = 0.0;
  double sum() const { return wi + wo; }
};

Chords chords(const brdf::DirectionPair& a, const brdf::DirectionPair& b) {
  const Eigen::AngleAxisd turn(best_turn(a, b).radians(), Eigen::Vector3d::UnitZ());
  return {(turn * a.wi - b.wi).squaredNorm(), (turn * a.wo - b.wo).squaredNorm()};
}

/// A cell that may be offered, and how far it is.
struct Offer {
  double distance = HUGE_VAL;
  std::uint32_t cell = 0;
  bool operator<(const Offer& other) const {
    return distance != other.distance ? distance < other.distance : cell < other.cell;
  }
};

Chords distance_to(std::uint32_t cell, const brdf::DirectionPair& wanted, bool reciprocal) {
  const auto pair =
      brdf::directions_from_half_diff(lattice::angles_of(lattice::index_from_cell(cell)));
  const Chords as_given = chords(pair, wanted);
  if (!reciprocal) return as_given;
  const Chords exchanged = chords({pair.wo, pair.wi}, wanted);
  return exchanged.sum() < as_given.sum() ? exchanged : as_given;
}

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

std::optional<Substitute> nearest_reachable(const Inverse& inverse,
                                            const brdf::HalfDiff& direction) {
  const std::vector<std::uint32_t>& cells = lattice::cells_above_horizon();
  const brdf::DirectionPair wanted = brdf::directions_from_half_diff(direction);
  const bool reciprocal = inverse.branches().reciprocal;
  const std::size_t wanted_offers = inverse.closed_form() ? 1 : kCandidatesToConfirm;

  // Each block keeps its best few; a cell is asked for its reach only when it would be among them.
  const std::vector<Offer> best = parallel::reduce_blocks(
      std::size_t{0}, cells.size(), kCellsPerBlock, std::vector<Offer>{},
      [&](std::size_t begin, std::size_t end) {
        std::vector<Offer> part;
        for (std::size_t i = begin; i < end; ++i) {
          const Offer offer{distance_to(cells[i], wanted, reciprocal).sum(), cells[i]};
          if (part.size() == wanted_offers && !(offer < part.back())) continue;
          if (!inverse.maybe_reachable(lattice::angles_of(lattice::index_from_cell(cells[i])))) {
            continue;
          }
          part.insert(std::lower_bound(part.begin(), part.end(), offer), offer);
          if (part.size() > wanted_offers) part.pop_back();
        }
        return part;
      },
      [&](std::vector<Offer>& total, std::vector<Offer>&& part) {
        total.insert(total.end(), part.begin(), part.end());
        std::sort(total.begin(), total.end());
        total.resize(std::min(total.size(), wanted_offers));
      });

  for (const Offer& offer : best) {
    const brdf::HalfDiff angles = lattice::angles_of(lattice::index_from_cell(offer.cell));
    if (!inverse.closed_form() && inverse.solve(angles).poses.empty()) continue;
    const Chords c = distance_to(offer.cell, wanted, reciprocal);
    const double half_chord = std::min(1.0, 0.5 * std::sqrt(std::max(c.wi, c.wo)));
    return Substitute{angles, Angle::from_radians(2.0 * std::asin(half_chord))};
  }
  return std::nullopt;
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
