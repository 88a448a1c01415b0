#include "gonio/render/metric_sphere.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <mutex>
#include <stdexcept>

#include "gonio/parallel/parallel.h"
#include "percentile.h"

namespace gonio::render {
namespace {

constexpr double kRimRadius2 = 0.995;
constexpr double kLeastCosine = 0.01;
constexpr double kPercentile = 0.9;
constexpr double kPercentileValue = 0.8;
constexpr std::size_t kPixelBlock = 256;

std::vector<Eigen::Vector3d> sphere_normals() {
  std::vector<Eigen::Vector3d> normals;
  for (int row = 0; row < MetricSphere::kSize; ++row) {
    for (int column = 0; column < MetricSphere::kSize; ++column) {
      const double x = (2.0 * column + 1.0) / MetricSphere::kSize - 1.0;
      const double y = 1.0 - (2.0 * row + 1.0) / MetricSphere::kSize;
      const double radius2 = x * x + y * y;
      if (radius2 < kRimRadius2) normals.emplace_back(x, y, std::sqrt(1.0 - radius2));
    }
  }
  return normals;
}

/// The pair as the surface sees it: any frame with z = normal does, the material is isotropic.
brdf::DirectionPair in_surface_frame(const Eigen::Vector3d& normal, const Eigen::Vector3d& wi) {
  const Eigen::Vector3d x = normal.unitOrthogonal();
  Eigen::Matrix3d surface_from_view;
  surface_from_view << x.transpose(), normal.cross(x).transpose(), normal.transpose();
  return {surface_from_view * wi, surface_from_view.col(2)};
}

}  // namespace

MetricSphere::MetricSphere(MetricLighting lighting, brdf::IndexConvention convention)
    : convention_(convention) {
  const std::vector<Eigen::Vector3d> normals = sphere_normals();
  const std::vector<DirectionalLight>& lights = lights_of(lighting);
  std::vector<std::vector<Term>> per_pixel(normals.size());
  parallel::for_each_block(0, normals.size(), kPixelBlock, [&](std::size_t from, std::size_t to) {
    for (std::size_t pixel = from; pixel < to; ++pixel) {
      for (const DirectionalLight& light : lights) {
        const double cosine = normals[pixel].dot(light.direction);
        if (cosine <= kLeastCosine) continue;
        const brdf::HalfDiff angles =
            brdf::half_diff_from_directions(in_surface_frame(normals[pixel], light.direction));
        const std::size_t cell =
            brdf::lattice::cell_from_index(brdf::lattice::nearest_index(angles, convention));
        per_pixel[pixel].push_back(
            {static_cast<std::uint32_t>(cell), static_cast<float>(cosine * light.irradiance)});
      }
    }
  });

  first_.reserve(normals.size() + 1);
  first_.push_back(0);
  for (const std::vector<Term>& terms : per_pixel) {
    terms_.insert(terms_.end(), terms.begin(), terms.end());
    first_.push_back(terms_.size());
  }
}

const MetricSphere& MetricSphere::shared(MetricLighting lighting,
                                         brdf::IndexConvention convention) {
  static std::array<std::once_flag, 6> built;
  static std::array<std::unique_ptr<const MetricSphere>, 6> spheres;
  const std::size_t at =
      static_cast<std::size_t>(lighting) * 3 + static_cast<std::size_t>(convention);
  std::call_once(built.at(at),
                 [&] { spheres[at] = std::make_unique<const MetricSphere>(lighting, convention); });
  return *spheres[at];
}

void MetricSphere::check(const brdf::BrdfTable& table) const {
  if (table.convention() != convention_) {
    throw std::invalid_argument("metric sphere for " + std::string(to_string(convention_)) +
                                " cells given a table of " +
                                std::string(to_string(table.convention())) + " cells");
  }
}

SphereRadiance MetricSphere::render(const brdf::BrdfTable& table) const {
  return render_pair(table, table).first;
}

std::pair<SphereRadiance, SphereRadiance> MetricSphere::render_pair(
    const brdf::BrdfTable& first, const brdf::BrdfTable& second) const {
  check(first);
  check(second);
  const bool same = &first == &second;
  std::pair<SphereRadiance, SphereRadiance> pictures;
  pictures.first.setZero(3, static_cast<Eigen::Index>(pixel_count()));
  if (!same) pictures.second.setZero(3, static_cast<Eigen::Index>(pixel_count()));

  parallel::for_each_block(0, pixel_count(), kPixelBlock, [&](std::size_t from, std::size_t to) {
    for (std::size_t pixel = from; pixel < to; ++pixel) {
      brdf::Rgb sum_first = brdf::Rgb::Zero();
      brdf::Rgb sum_second = brdf::Rgb::Zero();
      for (const Term& term : terms(pixel)) {
        if (!first.valid(term.cell)) continue;
        if (!same) {
          if (!second.valid(term.cell)) continue;
          sum_second += second.value(term.cell) * double{term.factor};
        }
        sum_first += first.value(term.cell) * double{term.factor};
      }
      pictures.first.col(static_cast<Eigen::Index>(pixel)) = sum_first;
      if (!same) pictures.second.col(static_cast<Eigen::Index>(pixel)) = sum_second;
    }
  });
  if (same) pictures.second = pictures.first;
  return pictures;
}

double metric_exposure(const SphereRadiance& picture) {
  const double high =
      percentile(std::vector<double>(picture.data(), picture.data() + picture.size()), kPercentile);
  return high > 0.0 ? kPercentileValue / high : 1.0;
}

SphereRadiance metric_display(const SphereRadiance& picture, double exposure) {
  return (picture * exposure).max(0.0).min(1.0).pow(1.0 / 2.2);
}

}  // namespace gonio::render
