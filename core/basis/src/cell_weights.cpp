#include "cell_weights.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>
#include <utility>

#include "gonio/brdf/merl_lattice.h"
#include "gonio/parallel/parallel.h"
#include "vector_math.h"

namespace gonio::basis::detail {
namespace {

namespace lattice = brdf::lattice;

constexpr std::size_t kWeightBlock = 16384;

/// The sine and cosine of an axis' indices: 360 pairs instead of 1.1 million.
template <std::size_t Count>
std::array<std::pair<double, double>, Count> sines_and_cosines(Angle (*angle_of)(int)) {
  std::array<std::pair<double, double>, Count> pairs;
  for (std::size_t i = 0; i < Count; ++i) {
    const double radians = angle_of(static_cast<int>(i)).radians();
    pairs[i] = {std::sin(radians), std::cos(radians)};
  }
  return pairs;
}

}  // namespace

std::vector<float> cell_weights(const LogMapping& mapping) {
  // The logarithm of the cells assumes normal floats; 1e-30 leaves room on both sides.
  if (!(mapping.epsilon > 1e-30 && mapping.epsilon < 1e30)) {
    throw std::invalid_argument("mapping: epsilon " + std::to_string(mapping.epsilon) +
                                ", expected a positive number");
  }
  if (!(mapping.cosine_floor > 0.0 && mapping.cosine_floor <= 1.0)) {
    throw std::invalid_argument("mapping: cosine floor " + std::to_string(mapping.cosine_floor) +
                                ", expected a number in (0, 1]");
  }
  const auto theta_h = sines_and_cosines<lattice::kThetaH>([](int i) {
    return lattice::angles_of({i, 0, 0}).theta_h;
  });
  const auto theta_d = sines_and_cosines<lattice::kThetaD>([](int i) {
    return lattice::angles_of({0, i, 0}).theta_d;
  });
  const auto phi_d = sines_and_cosines<lattice::kPhiD>([](int i) {
    return lattice::angles_of({0, 0, i}).phi_d;
  });

  const std::vector<std::uint32_t>& cells = lattice::cells_above_horizon();
  std::vector<float> weights(cells.size());
  parallel::for_each_block(0, cells.size(), kWeightBlock, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const lattice::Index at = lattice::index_from_cell(cells[i]);
      const auto [sin_h, cos_h] = theta_h[static_cast<std::size_t>(at.theta_h)];
      const auto [sin_d, cos_d] = theta_d[static_cast<std::size_t>(at.theta_d)];
      const double common = cos_h * cos_d;
      const double split = sin_h * sin_d * phi_d[static_cast<std::size_t>(at.phi_d)].second;
      weights[i] = static_cast<float>(mapping.weight({common - split, common + split}));
    }
  });
  return weights;
}

std::vector<std::uint32_t> map_table(const brdf::BrdfTable& table, const LogMapping& mapping,
                                     std::span<const float> weights, std::span<float> out) {
  const std::vector<std::uint32_t>& cells = lattice::cells_above_horizon();
  const std::size_t p = cells.size();
  const double* const stored = table.stored_planes().data();
  const float epsilon = static_cast<float>(mapping.epsilon);

  using Positions = std::vector<std::uint32_t>;
  return parallel::reduce_blocks(
      0, p, kWeightBlock, Positions{},
      [&](std::size_t begin, std::size_t end) {
        Positions missing;
        bool all_there = true;
        bool all_finite = true;
        for (std::size_t channel = 0; channel < 3; ++channel) {
          const double* const plane = stored + channel * lattice::kCells;
          const float scale = static_cast<float>(brdf::BrdfTable::kMerlScale[channel]);
          float* const values = out.data() + channel * p;
          for (std::size_t i = begin; i < end; ++i) {
            const float value = static_cast<float>(plane[cells[i]]);
            all_there &= value >= 0.0f;
            all_finite &= value <= std::numeric_limits<float>::max();
            values[i] = std::max(value * scale, 0.0f) * weights[i] + epsilon;
          }
        }
        if (!all_finite) {
          throw std::invalid_argument("a value is NaN, infinite or beyond single precision");
        }
        if (!all_there) {
          for (std::size_t i = begin; i < end; ++i) {
            if (table.valid(cells[i])) continue;
            missing.push_back(static_cast<std::uint32_t>(i));
            for (std::size_t channel = 0; channel < 3; ++channel) {
              out[channel * p + i] = epsilon;
            }
          }
        }
        for (std::size_t channel = 0; channel < 3; ++channel) {
          log_in_place(out.data() + channel * p + begin, end - begin);
        }
        return missing;
      },
      [](Positions& all, Positions&& part) { all.insert(all.end(), part.begin(), part.end()); });
}

}  // namespace gonio::basis::detail
