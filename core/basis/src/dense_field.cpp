#include "gonio/basis/dense_field.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <string>

#include "cell_weights.h"
#include "gonio/parallel/parallel.h"
#include "vector_math.h"

namespace gonio::basis {
namespace {

namespace lattice = brdf::lattice;

constexpr std::size_t kDenseBlock = 16384;
/// Cells whose three channels fit into the first-level cache between product and exponential.
constexpr std::size_t kChunkCells = 1024;

/// Channel after channel, padded with zeros to the basis' k.
std::vector<float> packed_coefficients(const Basis& basis, const Eigen::MatrixXd& coefficients) {
  const Eigen::Index k = basis.components.cols();
  if (coefficients.cols() != 3 || coefficients.rows() > k) {
    throw std::invalid_argument("coefficients of shape " + std::to_string(coefficients.rows()) +
                                " x " + std::to_string(coefficients.cols()) + ", expected " +
                                std::to_string(k) + " x 3");
  }
  std::vector<float> packed(static_cast<std::size_t>(3 * k), 0.0f);
  for (Eigen::Index channel = 0; channel < 3; ++channel) {
    for (Eigen::Index j = 0; j < coefficients.rows(); ++j) {
      packed[static_cast<std::size_t>(channel * k + j)] =
          static_cast<float>(coefficients(j, channel));
    }
  }
  return packed;
}

}  // namespace

Eigen::MatrixXf mapped_field(const Basis& basis, const Eigen::MatrixXd& coefficients) {
  const std::vector<float> packed = packed_coefficients(basis, coefficients);
  const Eigen::Index p = basis.components.rows();
  const std::size_t k = static_cast<std::size_t>(basis.components.cols());
  Eigen::MatrixXf field(p, 3);
  parallel::for_each_block(
      0, static_cast<std::size_t>(p), kDenseBlock, [&](std::size_t begin, std::size_t end) {
        detail::expand_rows(basis.components.data() + begin * k, basis.mean.data() + begin,
                            end - begin, k, packed.data(), field.col(0).data() + begin,
                            field.col(1).data() + begin, field.col(2).data() + begin);
      });
  return field;
}

Eigen::MatrixXd project(const Basis& basis, const Eigen::MatrixXf& field) {
  const Eigen::Index p = basis.components.rows();
  const Eigen::Index k = basis.components.cols();
  if (field.rows() != p || field.cols() != 3) {
    throw std::invalid_argument("project: field of shape " + std::to_string(field.rows()) + " x " +
                                std::to_string(field.cols()) + ", expected " + std::to_string(p) +
                                " x 3");
  }
  const auto sums_of_cells = [&](std::size_t begin, std::size_t end) {
    Eigen::MatrixXd sums = Eigen::MatrixXd::Zero(k, 3);
    std::array<std::array<float, kChunkCells>, 3> residual;
    for (std::size_t at = begin; at < end; at += kChunkCells) {
      const std::size_t count = std::min(kChunkCells, end - at);
      for (std::size_t channel = 0; channel < 3; ++channel) {
        const float* const x = field.col(static_cast<Eigen::Index>(channel)).data() + at;
        for (std::size_t i = 0; i < count; ++i) {
          residual[channel][i] =
              std::isfinite(x[i]) ? x[i] - basis.mean[static_cast<Eigen::Index>(at + i)] : 0.0f;
        }
      }
      detail::project_rows(basis.components.data() + at * static_cast<std::size_t>(k), count,
                           static_cast<std::size_t>(k), residual[0].data(), residual[1].data(),
                           residual[2].data(), sums.data());
    }
    return sums;
  };
  Eigen::MatrixXd coefficients = parallel::reduce_blocks(
      0, static_cast<std::size_t>(p), kDenseBlock, Eigen::MatrixXd(Eigen::MatrixXd::Zero(k, 3)),
      sums_of_cells, [](Eigen::MatrixXd& total, Eigen::MatrixXd&& part) { total += part; });
  // The columns of Q are orthogonal with the singular values as lengths.
  coefficients.array().colwise() /= basis.singular_values.head(k).array().square();
  return coefficients;
}

brdf::BrdfTable expand(const Basis& basis, const Eigen::MatrixXd& coefficients) {
  const std::vector<float> packed = packed_coefficients(basis, coefficients);
  const std::vector<float> weights = detail::cell_weights(basis.mapping);
  const std::vector<std::uint32_t>& cells = lattice::cells_above_horizon();
  if (static_cast<std::size_t>(basis.components.rows()) != cells.size()) {
    throw std::invalid_argument("expand: the basis does not cover the cells above the horizon");
  }
  const std::size_t k = static_cast<std::size_t>(basis.components.cols());
  const float epsilon = static_cast<float>(basis.mapping.epsilon);
  std::vector<double> stored(3 * lattice::kCells, -1.0);
  parallel::for_each_block(0, cells.size(), kDenseBlock, [&](std::size_t begin, std::size_t end) {
    std::array<std::array<float, kChunkCells>, 3> x;
    for (std::size_t at = begin; at < end; at += kChunkCells) {
      const std::size_t count = std::min(kChunkCells, end - at);
      detail::expand_rows(basis.components.data() + at * k, basis.mean.data() + at, count, k,
                          packed.data(), x[0].data(), x[1].data(), x[2].data());
      for (std::size_t channel = 0; channel < 3; ++channel) {
        detail::exp_in_place(x[channel].data(), count);
        double* const plane = stored.data() + channel * lattice::kCells;
        const double scale = brdf::BrdfTable::kMerlScale[channel];
        for (std::size_t i = 0; i < count; ++i) {
          const float above = std::max(x[channel][i] - epsilon, 0.0f);
          plane[cells[at + i]] =
              static_cast<double>(above) / (static_cast<double>(weights[at + i]) * scale);
        }
      }
    }
  });
  return brdf::BrdfTable(std::move(stored), brdf::IndexConvention::bin_centre, basis.scale);
}

brdf::BrdfTable table_of(const Basis& basis, const Eigen::MatrixXf& field) {
  const std::vector<std::uint32_t>& cells = lattice::cells_above_horizon();
  if (static_cast<std::size_t>(field.rows()) != cells.size() || field.cols() != 3) {
    throw std::invalid_argument("table_of: the field does not cover the cells above the horizon");
  }
  const std::vector<float> weights = detail::cell_weights(basis.mapping);
  const float epsilon = static_cast<float>(basis.mapping.epsilon);
  std::vector<double> stored(3 * lattice::kCells, -1.0);
  parallel::for_each_block(0, cells.size(), kChunkCells, [&](std::size_t begin, std::size_t end) {
    std::array<float, kChunkCells> x;
    for (std::size_t channel = 0; channel < 3; ++channel) {
      const float* const from = field.col(static_cast<Eigen::Index>(channel)).data();
      std::copy(from + begin, from + end, x.begin());
      detail::exp_in_place(x.data(), end - begin);
      double* const plane = stored.data() + channel * lattice::kCells;
      for (std::size_t i = begin; i < end; ++i) {
        plane[cells[i]] = static_cast<double>(std::max(x[i - begin] - epsilon, 0.0f)) /
                          (static_cast<double>(weights[i]) * brdf::BrdfTable::kMerlScale[channel]);
      }
    }
  });
  return brdf::BrdfTable(std::move(stored), brdf::IndexConvention::bin_centre, basis.scale);
}

}  // namespace gonio::basis
