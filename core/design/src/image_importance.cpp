#include "gonio/design/image_importance.h"

#include <cblas.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <string>
#include <vector>

#include "gonio/design/candidates.h"
#include "gonio/design/importance.h"
#include "gonio/parallel/parallel.h"
#include "gonio/random/stream.h"

namespace gonio::design {
namespace {

constexpr double kRimRadius2 = 0.995;
constexpr double kLeastCosine = 0.01;
constexpr double kPercentile = 0.9;
constexpr double kPercentileValue = 0.8;
constexpr double kDisplayPower = 1.0 / 2.2;
constexpr float kDarkest = 1e-3F;  // linear, of 1

/// What one pixel sees of one light.
struct Term {
  std::uint32_t cell;  // of the basis
  float factor;        // cos theta_i times irradiance
};

/// Pixels and lights drawn at random.
struct Scene {
  std::vector<Term> terms;         // pixel after pixel
  std::vector<std::size_t> first;  // where each pixel's begin; one more than pixels
};

Eigen::Vector3d random_direction(random::Stream& draw) {
  const double z = 2.0 * draw.uniform() - 1.0;
  const double azimuth = 2.0 * std::numbers::pi * draw.uniform();
  const double radius = std::sqrt(1.0 - z * z);
  return {radius * std::cos(azimuth), radius * std::sin(azimuth), z};
}

Eigen::Vector3d random_normal(random::Stream& draw) {
  const double radius2 = kRimRadius2 * draw.uniform();
  const double azimuth = 2.0 * std::numbers::pi * draw.uniform();
  const double radius = std::sqrt(radius2);
  return {radius * std::cos(azimuth), radius * std::sin(azimuth), std::sqrt(1.0 - radius2)};
}

Scene draw_scene(const ImageImportanceOptions& options, int number) {
  random::Stream draw(random::make_key(options.seed, "design.image_importance",
                                       static_cast<std::uint64_t>(number)));
  std::vector<Eigen::Vector3d> lights;
  std::vector<double> irradiances;
  for (int i = 0; i < options.lights; ++i) {
    lights.push_back(random_direction(draw));
    irradiances.push_back(std::exp(options.spread * draw.normal()));
  }
  Scene scene;
  scene.first.push_back(0);
  for (int pixel = 0; pixel < options.pixels; ++pixel) {
    const Eigen::Vector3d normal = random_normal(draw);
    const Eigen::Vector3d x = normal.unitOrthogonal();
    Eigen::Matrix3d surface_from_view;
    surface_from_view << x.transpose(), normal.cross(x).transpose(), normal.transpose();
    for (std::size_t i = 0; i < lights.size(); ++i) {
      const double cosine = normal.dot(lights[i]);
      if (cosine <= kLeastCosine) continue;
      const auto cell = basis_cell_of(brdf::half_diff_from_directions(
          {surface_from_view * lights[i], surface_from_view.col(2)}));
      if (cell) scene.terms.push_back({*cell, static_cast<float>(cosine * irradiances[i])});
    }
    scene.first.push_back(scene.terms.size());
  }
  return scene;
}

/// Rows of Q, mean and weight at a scene's terms.
struct SceneRows {
  basis::RowMajorMatrixXf q;
  Eigen::VectorXf mean;
  Eigen::VectorXf weight;
};

SceneRows gather(const basis::Basis& basis, const Scene& scene) {
  const auto count = static_cast<Eigen::Index>(scene.terms.size());
  SceneRows rows{{count, basis.components.cols()}, Eigen::VectorXf(count), Eigen::VectorXf(count)};
  for (Eigen::Index i = 0; i < count; ++i) {
    const std::uint32_t cell = scene.terms[static_cast<std::size_t>(i)].cell;
    rows.q.row(i) = basis.components.row(cell);
    rows.mean[i] = basis.mean[cell];
    const brdf::HalfDiff at = direction_of_basis_cell(cell);
    rows.weight[i] = static_cast<float>(
        basis.mapping.weight(brdf::polar_cosines(at.theta_h, at.theta_d, at.phi_d)));
  }
  return rows;
}

/// Value below which the given share of `values` lies (nearest rank).
float percentile(std::vector<float> values, double share) {
  const auto rank = static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), values.begin() + rank, values.end());
  return values[static_cast<std::size_t>(rank)];
}

/// Sum of J^T J over the pixels of a scene for the three rows of one material.
void add_material(const Scene& scene, const SceneRows& rows, const Eigen::MatrixXf& mapped,
                  float epsilon, basis::RowMajorMatrixXf& sum) {
  const std::size_t pixels = scene.first.size() - 1;
  const auto k = static_cast<int>(rows.q.cols());
  // Radiance, and its slope with the mapped value of every term.
  std::vector<float> radiance(3 * pixels, 0.0F);
  Eigen::MatrixXf slope(mapped.rows(), 3);
  for (Eigen::Index channel = 0; channel < 3; ++channel) {
    for (std::size_t pixel = 0; pixel < pixels; ++pixel) {
      for (std::size_t i = scene.first[pixel]; i < scene.first[pixel + 1]; ++i) {
        const auto term = static_cast<Eigen::Index>(i);
        const float value = std::exp(mapped(term, channel));
        const float share = scene.terms[i].factor / rows.weight[term];
        const bool black = value <= epsilon;  // reconstructions are clamped there
        slope(term, channel) = black ? 0.0F : share * value;
        radiance[static_cast<std::size_t>(channel) * pixels + pixel] +=
            black ? 0.0F : share * (value - epsilon);
      }
    }
  }
  const float high = percentile(radiance, kPercentile);
  if (!(high > 0.0F)) return;
  const auto exposure = static_cast<float>(kPercentileValue) / high;
  basis::RowMajorMatrixXf jacobian(static_cast<Eigen::Index>(3 * pixels), rows.q.cols());
  jacobian.setZero();
  for (std::size_t channel = 0; channel < 3; ++channel) {
    for (std::size_t pixel = 0; pixel < pixels; ++pixel) {
      const float shown = radiance[channel * pixels + pixel] * exposure;
      if (shown >= 1.0F) continue;
      const float steep =
          static_cast<float>(kDisplayPower) * exposure *
          std::pow(std::max(shown, kDarkest), static_cast<float>(kDisplayPower - 1.0));
      auto out = jacobian.row(static_cast<Eigen::Index>(channel * pixels + pixel));
      for (std::size_t i = scene.first[pixel]; i < scene.first[pixel + 1]; ++i) {
        const auto term = static_cast<Eigen::Index>(i);
        out += steep * slope(term, static_cast<Eigen::Index>(channel)) * rows.q.row(term);
      }
    }
  }
  cblas_ssyrk(CblasRowMajor, CblasUpper, CblasTrans, k, static_cast<int>(jacobian.rows()), 1.0F,
              jacobian.data(), k, 1.0F, sum.data(), k);
}

}  // namespace

void ImageImportanceOptions::validate() const {
  const auto refuse = [](const std::string& what) {
    throw std::invalid_argument("image importance: " + what);
  };
  if (scenes < 1) refuse("scenes must be at least 1");
  if (pixels < 8) refuse("pixels must be at least 8");
  if (lights < 1) refuse("lights must be at least 1");
  if (!(spread >= 0.0 && spread <= 5.0)) refuse("spread must lie between 0 and 5");
}

Eigen::MatrixXd image_importance(const basis::Basis& basis, const Eigen::MatrixXd& left_vectors,
                                 const ImageImportanceOptions& options) {
  options.validate();
  const Eigen::Index k = basis.components.cols();
  const Eigen::Index m = left_vectors.rows();
  if (left_vectors.cols() != k || m == 0 || m % 3 != 0 ||
      static_cast<std::size_t>(basis.components.rows()) != basis_cell_count()) {
    throw std::invalid_argument("image importance: left vectors of " + std::to_string(m) + " x " +
                                std::to_string(left_vectors.cols()) + " for a basis of " +
                                std::to_string(k) + " components");
  }
  const Eigen::MatrixXf left = left_vectors.cast<float>();
  const auto epsilon = static_cast<float>(basis.mapping.epsilon);
  const auto materials = static_cast<std::size_t>(m / 3);
  Eigen::MatrixXd total = Eigen::MatrixXd::Zero(k, k);
  for (int number = 0; number < options.scenes; ++number) {
    const Scene scene = draw_scene(options, number);
    const SceneRows rows = gather(basis, scene);
    // A few materials per task: enough tasks for the threads, one k x k sum for each.
    constexpr std::size_t kMaterials = 8;
    total = parallel::reduce_blocks(
        0, materials, kMaterials, std::move(total),
        [&](std::size_t from, std::size_t to) {
          basis::RowMajorMatrixXf sum = basis::RowMajorMatrixXf::Zero(k, k);
          for (std::size_t g = from; g < to; ++g) {
            Eigen::MatrixXf mapped =
                rows.q * left.middleRows<3>(static_cast<Eigen::Index>(3 * g)).transpose();
            mapped.colwise() += rows.mean;
            add_material(scene, rows, mapped, epsilon, sum);
          }
          return Eigen::MatrixXd(
              Eigen::MatrixXd(sum.cast<double>()).selfadjointView<Eigen::Upper>());
        },
        [](Eigen::MatrixXd& sum, Eigen::MatrixXd&& part) { sum += part; });
  }
  return total / (static_cast<double>(m) * options.pixels * options.scenes);
}

Eigen::MatrixXd blended_importance(const basis::Basis& basis, const Eigen::MatrixXd& left_vectors,
                                   const ImportanceBlend& blend,
                                   const ImageImportanceOptions& options) {
  if (!(blend.uniform >= 0.0 && blend.image >= 0.0 && blend.uniform + blend.image <= 1.0)) {
    throw std::invalid_argument("importance: shares of uniform " + std::to_string(blend.uniform) +
                                " and image " + std::to_string(blend.image) +
                                ", expected 0 to 1 together");
  }
  const auto of_cells = [&](double uniform) {
    return importance_matrix(basis.components, importance_weights({uniform}));
  };
  if (blend.image == 0.0) return of_cells(blend.uniform);
  const Eigen::MatrixXd solid_angle = of_cells(0.0);
  const Eigen::MatrixXd image = image_importance(basis, left_vectors, options);
  Eigen::MatrixXd sum = (1.0 - blend.uniform - blend.image) * solid_angle +
                        blend.image * (solid_angle.trace() / image.trace()) * image;
  if (blend.uniform > 0.0) sum += blend.uniform * of_cells(1.0);
  return sum;
}

}  // namespace gonio::design
