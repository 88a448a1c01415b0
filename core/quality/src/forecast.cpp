#include "gonio/quality/forecast.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <vector>

#include "gonio/brdf/merl_lattice.h"
#include "gonio/parallel/parallel.h"
#include "gonio/quality/evaluate.h"
#include "gonio/render/metric_sphere.h"

namespace gonio::quality {
namespace {

// Every so many pixels of the sphere: 450 are enough for a hundredth of a decibel of the mean.
constexpr std::size_t kForecastStride = 16;
constexpr std::size_t kForecastBlock = 8;

std::vector<std::int32_t> row_of_cell() {
  std::vector<std::int32_t> rows(brdf::lattice::kCells, -1);
  std::int32_t row = 0;
  for (const std::uint32_t cell : brdf::lattice::cells_above_horizon()) rows[cell] = row++;
  return rows;
}

/// Mean square difference of the displays of two pictures, 3 x pixels each, exposed for the first.
double display_error(const render::SphereRadiance& truth, const render::SphereRadiance& found) {
  const double exposure = render::metric_exposure(truth);
  return (render::metric_display(truth, exposure) - render::metric_display(found, exposure))
      .square()
      .mean();
}

}  // namespace

Forecast forecast(const basis::Basis& basis, const Eigen::MatrixXd& residuals) {
  const Eigen::Index m = basis.left_vectors.rows();
  const Eigen::Index k = basis.components.cols();
  if (residuals.rows() != m || residuals.cols() != k || basis.left_vectors.cols() != k ||
      m % 3 != 0 || m < 6) {
    throw std::invalid_argument("forecast: residuals of " + std::to_string(residuals.rows()) +
                                " x " + std::to_string(residuals.cols()) + ", expected " +
                                std::to_string(m) + " x " + std::to_string(k));
  }
  // Below each other: what the materials are, what is found.
  Eigen::MatrixXf coefficients(2 * m, k);
  coefficients << basis.left_vectors.cast<float>(), (basis.left_vectors - residuals).cast<float>();
  const auto epsilon = static_cast<float>(basis.mapping.epsilon);
  const std::vector<std::int32_t> row_of = row_of_cell();
  const render::MetricSphere& sphere =
      render::MetricSphere::shared(render::MetricLighting::a, brdf::IndexConvention::bin_centre);
  const std::size_t pixels = (sphere.pixel_count() + kForecastStride - 1) / kForecastStride;
  Eigen::MatrixXf radiance(2 * m, static_cast<Eigen::Index>(pixels));
  parallel::for_each_block(0, pixels, kForecastBlock, [&](std::size_t from, std::size_t to) {
    for (std::size_t pixel = from; pixel < to; ++pixel) {
      const auto terms = sphere.terms(pixel * kForecastStride);
      const auto count = static_cast<Eigen::Index>(terms.size());
      Eigen::MatrixXf q(k, count);
      Eigen::RowVectorXf mean(count);
      Eigen::VectorXf factor(count);
      Eigen::Index used = 0;
      for (const render::MetricSphere::Term& term : terms) {
        const std::int32_t row = row_of[term.cell];
        if (row < 0) continue;
        const brdf::HalfDiff at =
            brdf::lattice::angles_of(brdf::lattice::index_from_cell(term.cell));
        q.col(used) = basis.components.row(row).transpose();
        mean[used] = basis.mean[row];
        factor[used] = term.factor / static_cast<float>(basis.mapping.weight(
                                         brdf::polar_cosines(at.theta_h, at.theta_d, at.phi_d)));
        ++used;
      }
      Eigen::MatrixXf mapped = coefficients * q.leftCols(used);
      mapped.rowwise() += mean.head(used);
      radiance.col(static_cast<Eigen::Index>(pixel)) =
          (mapped.array().exp() - epsilon).max(0.0F).matrix() * factor.head(used);
    }
  });

  std::vector<double> psnr(static_cast<std::size_t>(m / 3));
  for (Eigen::Index g = 0; g < m / 3; ++g) {
    const render::SphereRadiance truth = radiance.middleRows(3 * g, 3).cast<double>().array();
    const render::SphereRadiance found = radiance.middleRows(m + 3 * g, 3).cast<double>().array();
    // A perfect picture would be infinite; a thousandth of the last grey level is as good.
    psnr[static_cast<std::size_t>(g)] =
        -10.0 * std::log10(std::max(display_error(truth, found), 1e-11));
  }
  const Summary summary = summarise(psnr);
  double squares = 0.0;
  for (const double each : psnr) squares += (each - summary.mean) * (each - summary.mean);
  const double count = static_cast<double>(psnr.size());
  return {summary.mean, std::sqrt(squares / (count * (count - 1.0))), summary.tenth_percentile};
}

}  // namespace gonio::quality
