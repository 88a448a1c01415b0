#include "gonio/design/expected_noise.h"

#include <cmath>
#include <stdexcept>

#include "gonio/brdf/merl_lattice.h"
#include "gonio/parallel/parallel.h"

namespace gonio::design {
namespace {

namespace lattice = brdf::lattice;

constexpr std::size_t kNoiseBlock = 8192;

/// Rows of the basis by lattice cell, -1 below the horizon.
std::vector<std::int32_t> rows_of_cells() {
  std::vector<std::int32_t> rows(lattice::kCells, -1);
  std::int32_t row = 0;
  for (const std::uint32_t cell : lattice::cells_above_horizon()) rows[cell] = row++;
  return rows;
}

/// m times the mean square over training materials of the step between two rows.
double step_square(const basis::Basis& basis, Eigen::Index a, Eigen::Index b) {
  const double mean = static_cast<double>(basis.mean[a] - basis.mean[b]);
  return basis.row_count() * mean * mean +
         static_cast<double>((basis.components.row(a) - basis.components.row(b)).squaredNorm());
}

}  // namespace

std::vector<float> expected_noise(const basis::Basis& basis, const ExpectedNoise& noise) {
  const std::vector<std::uint32_t>& cells = lattice::cells_above_horizon();
  if (static_cast<std::size_t>(basis.components.rows()) != cells.size()) {
    throw std::invalid_argument("expected noise: the basis is of another lattice");
  }
  if (!(noise.relative >= 0.0 && noise.relative <= 1.0) ||
      !(noise.direction.radians() >= 0.0 && noise.direction.radians() <= 1.0)) {
    throw std::invalid_argument("expected noise: relative and direction lie in [0, 1]");
  }
  const std::vector<std::int32_t> row_of = rows_of_cells();
  const double m = basis.row_count();
  const double direction2 = noise.direction.radians() * noise.direction.radians();
  std::vector<float> result(cells.size());
  parallel::for_each_block(0, cells.size(), kNoiseBlock, [&](std::size_t from, std::size_t to) {
    for (std::size_t i = from; i < to; ++i) {
      const auto row = static_cast<Eigen::Index>(i);
      // w f = exp(x) - eps.
      const double signal =
          1.0 - basis.mapping.epsilon * std::exp(-static_cast<double>(basis.mean[row]));
      const double value = noise.relative * std::max(signal, 0.0);
      double variance = m * value * value;
      if (direction2 > 0.0) {
        const lattice::Index at = lattice::index_from_cell(cells[i]);
        // Slope square along one axis, towards the neighbour that is above the horizon.
        const auto add_axis = [&](lattice::Index up, lattice::Index down, bool has_up,
                                  bool has_down) {
          const std::int32_t high = has_up ? row_of[lattice::cell_from_index(up)] : -1;
          const std::int32_t low = has_down ? row_of[lattice::cell_from_index(down)] : -1;
          const Eigen::Index a = high >= 0 ? high : row;
          const Eigen::Index b = low >= 0 ? low : row;
          if (a == b) return;
          const brdf::HalfDiff from_angles = lattice::angles_of(low >= 0 ? down : at);
          const brdf::HalfDiff to_angles = lattice::angles_of(high >= 0 ? up : at);
          const double h = (to_angles.theta_h - from_angles.theta_h).radians();
          const double d = (to_angles.theta_d - from_angles.theta_d).radians();
          variance += direction2 * step_square(basis, a, b) / (h * h + d * d);
        };
        add_axis({at.theta_h + 1, at.theta_d, at.phi_d}, {at.theta_h - 1, at.theta_d, at.phi_d},
                 at.theta_h + 1 < static_cast<int>(lattice::kThetaH), at.theta_h > 0);
        add_axis({at.theta_h, at.theta_d + 1, at.phi_d}, {at.theta_h, at.theta_d - 1, at.phi_d},
                 at.theta_d + 1 < static_cast<int>(lattice::kThetaD), at.theta_d > 0);
      }
      result[i] = static_cast<float>(variance);
    }
  });
  return result;
}

}  // namespace gonio::design
