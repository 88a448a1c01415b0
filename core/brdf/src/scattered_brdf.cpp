#include "gonio/brdf/scattered_brdf.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>

#include "gonio/parallel/parallel.h"
#include "nearest_points.h"

namespace gonio::brdf {
namespace {

constexpr std::size_t kNeighbours = 20;
constexpr double kReach = 0.25;
constexpr double kBeyondMeasured_deg = 5.0;
constexpr double kEpsilon = 1e-3;
/// A place this near to a sample is the sample's: rounding of angles.
constexpr double kSamePlace = 1e-7;
/// Keeps the slopes of a degenerate neighbourhood (all samples on a line) at 0; relative to the
/// neighbourhood's own spread.
constexpr double kSlopePrior = 1e-6;
constexpr std::size_t kScatteredBlock = 4096;

NearestPoints::Point coordinates(const HalfDiff& at, int folds) {
  const double root = std::sqrt(at.theta_h.radians());
  const double radius = root * sin(at.theta_d);
  const double angle = folds * at.phi_d.radians();
  return {2.0 * root, at.theta_d.radians(), radius * std::cos(angle), radius * std::sin(angle)};
}

/// All samples on one side of the plane of incidence (those in it belong to both).
bool one_sided(std::span<const ScatteredValue> samples) {
  constexpr double kInPlane = 1e-6;
  bool left = false;
  bool right = false;
  for (const ScatteredValue& sample : samples) {
    const double side =
        sample.pair.wi.x() * sample.pair.wo.y() - sample.pair.wi.y() * sample.pair.wo.x();
    left |= side > kInPlane;
    right |= side < -kInPlane;
  }
  return left != right;
}

}  // namespace

struct ScatteredBrdf::Prepared {
  Prepared(NearestPoints nearest_points, std::vector<Rgb> mapped_values, int phi_folds,
           double lowest)
      : nearest(std::move(nearest_points)),
        mapped(std::move(mapped_values)),
        folds(phi_folds),
        lowest_cosine(lowest) {}

  Rgb mapped_at(const NearestPoints::Point& at) const;

  NearestPoints nearest;
  std::vector<Rgb> mapped;
  int folds;
  double lowest_cosine;
};

Rgb ScatteredBrdf::Prepared::mapped_at(const NearestPoints::Point& at) const {
  std::vector<NearestPoints::Found> found;
  nearest.find(at, kNeighbours, found);
  Rgb low = mapped[found.front().index];
  Rgb high = low;
  if (found.front().squared_distance < kSamePlace * kSamePlace) return low;
  // The farthest has weight 0, unless all are equally far.
  const double reach = std::sqrt(found.back().squared_distance) * (1.0 + 1e-9);
  Eigen::Matrix<double, 5, 5> normal = Eigen::Matrix<double, 5, 5>::Zero();
  Eigen::Matrix<double, 5, 3> right = Eigen::Matrix<double, 5, 3>::Zero();
  for (const NearestPoints::Found& each : found) {
    const double ratio = std::sqrt(each.squared_distance) / reach;
    const double cube = 1.0 - ratio * ratio * ratio;
    const double tricube = std::fmax(cube * cube * cube, 1e-12);
    Eigen::Matrix<double, 5, 1> row;
    row << 1.0, (nearest.point(each.index) - at) / reach;
    const Rgb& value = mapped[each.index];
    normal += tricube * row * row.transpose();
    right += tricube * row * value.matrix().transpose();
    low = low.min(value);
    high = high.max(value);
  }
  normal.diagonal().tail<4>().array() += kSlopePrior * normal(0, 0);
  const Rgb value = normal.ldlt().solve(right).row(0).transpose().array();
  return value.max(low).min(high);
}

ScatteredBrdf::ScatteredBrdf(std::span<const ScatteredValue> samples, Symmetry symmetry) {
  if (samples.size() < kFewestSamples) {
    throw std::invalid_argument("found " + std::to_string(samples.size()) +
                                " samples, expected at least " + std::to_string(kFewestSamples) +
                                " to interpolate between");
  }
  const int folds = symmetry == Symmetry::reciprocal ? 2 : 1;
  const bool mirror = symmetry == Symmetry::one_way && one_sided(samples);
  std::vector<NearestPoints::Point> points;
  std::vector<Rgb> mapped;
  double lowest = 1.0;
  for (const ScatteredValue& sample : samples) {
    const double cosine = std::fmin(sample.pair.wi.z(), sample.pair.wo.z());
    if (!(cosine > 0.0)) throw std::invalid_argument("a sample lies at or below the horizon");
    if (!sample.per_sr.isFinite().all() || sample.per_sr.minCoeff() < 0.0) {
      throw std::invalid_argument("a sample is negative or not finite");
    }
    lowest = std::fmin(lowest, cosine);
    HalfDiff at = half_diff_from_directions(sample.pair);
    const Rgb value = (sample.per_sr + kEpsilon).log();
    for (int image = 0; image < (mirror ? 2 : 1); ++image) {
      points.push_back(coordinates(at, folds));
      mapped.push_back(value);
      at.phi_d = -at.phi_d;
    }
  }
  prepared_ = std::make_unique<const Prepared>(NearestPoints(std::move(points)), std::move(mapped),
                                               folds, lowest);
}

ScatteredBrdf::~ScatteredBrdf() = default;
ScatteredBrdf::ScatteredBrdf(ScatteredBrdf&&) noexcept = default;

Rgb ScatteredBrdf::evaluate(const DirectionPair& pair) const {
  if (pair.wi.z() <= 0.0 || pair.wo.z() <= 0.0) return Rgb::Zero();
  const Rgb mapped =
      prepared_->mapped_at(coordinates(half_diff_from_directions(pair), prepared_->folds));
  return (mapped.exp() - kEpsilon).max(0.0);
}

bool ScatteredBrdf::covers(const DirectionPair& pair) const {
  const double cosine = std::fmin(pair.wi.z(), pair.wo.z());
  if (!(cosine > 0.0)) return false;
  constexpr double kDegree = std::numbers::pi / 180.0;
  if (std::acos(std::fmin(cosine, 1.0)) >
      std::acos(prepared_->lowest_cosine) + kBeyondMeasured_deg * kDegree) {
    return false;
  }
  std::vector<NearestPoints::Found> found;
  prepared_->nearest.find(coordinates(half_diff_from_directions(pair), prepared_->folds), 1, found);
  return found.front().squared_distance <= kReach * kReach;
}

BrdfTable tabulate_covered(const ScatteredBrdf& brdf, RadiometricScale scale) {
  BrdfTable table(IndexConvention::bin_centre, scale);
  const std::vector<std::uint32_t>& cells = lattice::cells_above_horizon();
  parallel::for_each_block(
      0, cells.size(), kScatteredBlock, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
          const DirectionPair pair =
              directions_from_half_diff(lattice::angles_of(lattice::index_from_cell(cells[i])));
          if (brdf.covers(pair)) table.set_value(cells[i], brdf.evaluate(pair));
        }
      });
  return table;
}

}  // namespace gonio::brdf
