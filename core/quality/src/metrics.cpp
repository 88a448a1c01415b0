#include "gonio/quality/metrics.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

#include "gonio/brdf/cell_weight.h"
#include "gonio/brdf/shading_geometry.h"
#include "gonio/parallel/parallel.h"
#include "gonio/render/colour.h"
#include "grazing_band.h"

namespace gonio::quality {
namespace {

constexpr std::size_t kPixelBlock = 512;

/// A lattice has one set of angles per index and axis.
std::vector<brdf::SinCos> axis_angles(std::size_t count, brdf::IndexConvention convention,
                                      int brdf::lattice::Index::*axis,
                                      Angle brdf::HalfDiff::*angle) {
  std::vector<brdf::SinCos> angles;
  angles.reserve(count);
  for (std::size_t i = 0; i < count; ++i) {
    brdf::lattice::Index index{0, 0, 0};
    index.*axis = static_cast<int>(i);
    angles.emplace_back(brdf::lattice::angles_of(index, convention).*angle);
  }
  return angles;
}

struct Sums {
  double weight = 0.0;
  double weighted = 0.0;
  double weighted_square = 0.0;
  double grazing = 0.0;
  double grazing_square = 0.0;
  double raw_square = 0.0;
  std::size_t cells = 0;
  std::size_t grazing_cells = 0;
  std::size_t only_in_truth = 0;
  std::size_t only_in_found = 0;

  void add(const Sums& other) {
    weight += other.weight;
    weighted += other.weighted;
    weighted_square += other.weighted_square;
    grazing += other.grazing;
    grazing_square += other.grazing_square;
    raw_square += other.raw_square;
    cells += other.cells;
    grazing_cells += other.grazing_cells;
    only_in_truth += other.only_in_truth;
    only_in_found += other.only_in_found;
  }
};

void require_same_meaning(const brdf::BrdfTable& truth, const brdf::BrdfTable& found) {
  if (truth.convention() != found.convention()) {
    throw std::invalid_argument("cannot compare BRDFs: the truth's cells are " +
                                std::string(to_string(truth.convention())) + ", the other's " +
                                std::string(to_string(found.convention())));
  }
  if (truth.scale() != found.scale()) {
    throw std::invalid_argument("cannot compare BRDFs: the truth's radiometric scale is " +
                                std::string(to_string(truth.scale())) + ", the other's " +
                                std::string(to_string(found.scale())));
  }
}

}  // namespace

LatticeError lattice_error(const brdf::BrdfTable& truth, const brdf::BrdfTable& found,
                           const basis::LogMapping& mapping) {
  require_same_meaning(truth, found);
  namespace lattice = brdf::lattice;
  using lattice::Index;
  const brdf::IndexConvention convention = truth.convention();
  const auto theta_h =
      axis_angles(lattice::kThetaH, convention, &Index::theta_h, &brdf::HalfDiff::theta_h);
  const auto theta_d =
      axis_angles(lattice::kThetaD, convention, &Index::theta_d, &brdf::HalfDiff::theta_d);
  const auto phi_d = axis_angles(lattice::kPhiD, convention, &Index::phi_d, &brdf::HalfDiff::phi_d);
  const std::vector<std::uint8_t>& above = lattice::above_horizon_mask(convention);
  const GrazingBand band;

  const auto sum_rows = [&](std::size_t from, std::size_t to) {
    Sums sums;
    for (std::size_t row = from; row < to; ++row) {
      const brdf::SinCos& th = theta_h[row / lattice::kThetaD];
      const brdf::SinCos& td = theta_d[row % lattice::kThetaD];
      const double solid_angle = brdf::relative_solid_angle(th, td);
      for (std::size_t column = 0; column < lattice::kPhiD; ++column) {
        const std::size_t cell = row * lattice::kPhiD + column;
        if (above[cell] == 0) continue;
        const bool in_truth = truth.valid(cell);
        const bool in_found = found.valid(cell);
        if (!in_truth || !in_found) {
          sums.only_in_truth += in_truth ? 1 : 0;
          sums.only_in_found += in_found ? 1 : 0;
          continue;
        }
        const brdf::ShadingGeometry geometry = brdf::shading_geometry(th, td, phi_d[column]);
        const double w = mapping.weight({geometry.cos_theta_i, geometry.cos_theta_o});
        const double weight = solid_angle * geometry.cos_theta_i * geometry.cos_theta_o;
        const brdf::Rgb t = truth.value(cell);
        const brdf::Rgb f = found.value(cell);
        double step = 0.0;
        double square = 0.0;
        for (int channel = 0; channel < 3; ++channel) {
          const double d = mapping.forward(f[channel], w) - mapping.forward(t[channel], w);
          step += d;
          square += d * d;
        }
        ++sums.cells;
        sums.weight += weight;
        sums.weighted += weight * step;
        sums.weighted_square += weight * square;
        sums.raw_square += (f - t).square().sum();
        if (band.holds(std::min(geometry.cos_theta_i, geometry.cos_theta_o))) {
          ++sums.grazing_cells;
          sums.grazing += step;
          sums.grazing_square += square;
        }
      }
    }
    return sums;
  };
  const Sums total =
      parallel::reduce_blocks(0, lattice::kThetaH * lattice::kThetaD, lattice::kThetaD, Sums(),
                              sum_rows, [](Sums& sum, Sums&& part) { sum.add(part); });
  if (total.cells == 0) {
    throw std::invalid_argument("cannot compare BRDFs: no cell is valid in both");
  }

  LatticeError error;
  error.weighted_log_rmse = std::sqrt(total.weighted_square / (3.0 * total.weight));
  error.weighted_log_bias = total.weighted / (3.0 * total.weight);
  const double grazing_values = 3.0 * static_cast<double>(total.grazing_cells);
  error.grazing_log_rmse = std::sqrt(total.grazing_square / grazing_values);
  error.grazing_log_bias = total.grazing / grazing_values;
  error.raw_rmse_per_sr = std::sqrt(total.raw_square / (3.0 * static_cast<double>(total.cells)));
  error.cells = total.cells;
  error.grazing_cells = total.grazing_cells;
  error.only_in_truth = total.only_in_truth;
  error.only_in_found = total.only_in_found;
  return error;
}

PictureError picture_error(const render::SphereRadiance& truth,
                           const render::SphereRadiance& found) {
  if (truth.cols() != found.cols() || truth.cols() == 0) {
    throw std::invalid_argument("cannot compare pictures of " + std::to_string(truth.cols()) +
                                " and " + std::to_string(found.cols()) + " pixels");
  }
  const double exposure = render::metric_exposure(truth);
  const render::SphereRadiance step =
      render::metric_display(found, exposure) - render::metric_display(truth, exposure);
  PictureError error;
  error.psnr_db = -10.0 * std::log10(step.square().mean());

  const auto pixels = static_cast<std::size_t>(truth.cols());
  const double sum = parallel::reduce_blocks(
      0, pixels, kPixelBlock, 0.0,
      [&](std::size_t from, std::size_t to) {
        double part = 0.0;
        for (std::size_t pixel = from; pixel < to; ++pixel) {
          const auto at = static_cast<Eigen::Index>(pixel);
          const Eigen::Array3d a = (truth.col(at) * exposure).max(0.0).min(1.0);
          const Eigen::Array3d b = (found.col(at) * exposure).max(0.0).min(1.0);
          part += render::delta_e_2000(render::lab_from_linear_srgb(a),
                                       render::lab_from_linear_srgb(b));
        }
        return part;
      },
      [](double& total, double&& part) { total += part; });
  error.mean_delta_e = sum / static_cast<double>(pixels);
  return error;
}

PictureError picture_error(const brdf::BrdfTable& truth, const brdf::BrdfTable& found,
                           render::MetricLighting lighting) {
  require_same_meaning(truth, found);
  const auto [true_picture, found_picture] =
      render::MetricSphere::shared(lighting, truth.convention()).render_pair(truth, found);
  return picture_error(true_picture, found_picture);
}

Comparison compare(const brdf::BrdfTable& truth, const brdf::BrdfTable& found,
                   const basis::LogMapping& mapping) {
  return {lattice_error(truth, found, mapping),
          picture_error(truth, found, render::MetricLighting::a),
          picture_error(truth, found, render::MetricLighting::b)};
}

}  // namespace gonio::quality
