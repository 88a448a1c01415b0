#include "gonio/design/coverage.h"

#include <Eigen/Cholesky>
#include <array>
#include <cmath>
#include <stdexcept>
#include <string>

#include "gonio/brdf/merl_lattice.h"
#include "gonio/design/criteria.h"
#include "gonio/parallel/parallel.h"

namespace gonio::design {
namespace {

namespace lattice = brdf::lattice;

constexpr int kParts = 6;
constexpr int kPolarIndices = static_cast<int>(lattice::kThetaH) / kParts;
constexpr int kAzimuthIndices = static_cast<int>(lattice::kPhiD) / kParts;
constexpr std::size_t kRegions = kParts * kParts * kParts;
constexpr std::size_t kCoverageBlock = 8192;

struct Sums {
  std::array<double, kRegions> error{};   // importance times variance
  std::array<double, kRegions> square{};  // variance
  std::array<double, kRegions> cells{};
};

LatticeRegion region(int h, int d, int a) {
  const auto theta_h = [](int part) {
    const double share = static_cast<double>(part) / kParts;
    return Angle::from_degrees(90.0 * share * share);
  };
  const auto theta_d = [](int part) { return Angle::from_degrees(kPolarIndices * part); };
  const auto phi_d = [](int part) { return Angle::from_degrees(kAzimuthIndices * part); };
  return {theta_h(h), theta_h(h + 1), theta_d(d), theta_d(d + 1), phi_d(a), phi_d(a + 1)};
}

}  // namespace

UncoveredRegion largest_uncovered_region(const basis::Basis& basis, const Eigen::MatrixXd& rows,
                                         const Eigen::VectorXf& weights, double eta) {
  const std::vector<std::uint32_t>& cells = lattice::cells_above_horizon();
  if (static_cast<std::size_t>(basis.components.rows()) != cells.size() ||
      weights.size() != basis.components.rows() || rows.cols() != basis.components.cols()) {
    throw std::invalid_argument("coverage: " + std::to_string(weights.size()) + " weights, " +
                                std::to_string(rows.cols()) + " components, basis of " +
                                std::to_string(basis.components.rows()) + " x " +
                                std::to_string(basis.components.cols()));
  }
  // A root of M: the variance is the squared length of a row times it.
  const Eigen::MatrixXf root = Eigen::MatrixXd(open_share(rows, eta).llt().matrixL()).cast<float>();
  const Sums sums = parallel::reduce_blocks(
      0, cells.size(), kCoverageBlock, Sums{},
      [&](std::size_t from, std::size_t to) {
        const auto first = static_cast<Eigen::Index>(from);
        const auto count = static_cast<Eigen::Index>(to - from);
        const Eigen::VectorXf variance =
            (basis.components.middleRows(first, count) * root).rowwise().squaredNorm();
        Sums part;
        for (Eigen::Index i = 0; i < count; ++i) {
          const lattice::Index at =
              lattice::index_from_cell(cells[from + static_cast<std::size_t>(i)]);
          const auto number = static_cast<std::size_t>(
              (at.theta_h / kPolarIndices * kParts + at.theta_d / kPolarIndices) * kParts +
              at.phi_d / kAzimuthIndices);
          part.error[number] += static_cast<double>(variance[i] * weights[first + i]);
          part.square[number] += static_cast<double>(variance[i]);
          part.cells[number] += 1.0;
        }
        return part;
      },
      [](Sums& total, Sums&& part) {
        for (std::size_t i = 0; i < kRegions; ++i) {
          total.error[i] += part.error[i];
          total.square[i] += part.square[i];
          total.cells[i] += part.cells[i];
        }
      });
  std::size_t largest = 0;
  double whole = 0.0;
  for (std::size_t i = 0; i < kRegions; ++i) {
    whole += sums.error[i];
    if (sums.error[i] > sums.error[largest]) largest = i;
  }
  const int number = static_cast<int>(largest);
  return {region(number / (kParts * kParts), number / kParts % kParts, number % kParts),
          whole > 0.0 ? sums.error[largest] / whole : 0.0,
          std::sqrt(sums.square[largest] / std::max(sums.cells[largest], 1.0) /
                    static_cast<double>(basis.row_count()))};
}

}  // namespace gonio::design
