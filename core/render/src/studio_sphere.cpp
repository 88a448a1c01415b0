#include "studio_sphere.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "environment_table.h"
#include "gonio/parallel/parallel.h"
#include "view_geometry.h"

// The viewer looks along z from far away and the material is isotropic, so everything but the
// studio is symmetric about z: points of the sphere at the same distance from its centre (a ring)
// see the same reflections, turned. Per ring the BRDF is integrated over half vectors once, which
// gives a list of (direction, weight); a point's radiance is that list, turned to it, times the
// studio. With the studio stored on rings around z, turning is a shift along a row.
namespace gonio::render {
namespace {

constexpr int kProbes = 180;  // of the importance over theta_h
constexpr int kStrata = 48;   // of theta_h
constexpr int kLeastTurns = 12;
constexpr int kMostTurns = 72;  // points around the normal per stratum
constexpr double kEvenShare = 0.45;
constexpr double kGoldenTurn = 0.618033988749895;

/// theta_h in the square-root spaced coordinate the lattice uses: fine where lobes are.
double theta_h_of(double u) { return u * u * std::numbers::pi / 2.0; }

/// Stratum limits in u, 0 to 1: half even, half by how much the models reflect there.
std::vector<double> strata_of(std::span<const brdf::BrdfModel* const> models) {
  constexpr std::array kThetaDDeg = {8.0, 30.0, 52.0, 70.0};
  constexpr std::array kPhiDDeg = {30.0, 90.0, 150.0};
  std::vector<double> density(kProbes, 0.0);
  for (std::size_t m = 0; m < std::min<std::size_t>(models.size(), 2); ++m) {
    std::vector<double> own(kProbes, 0.0);
    double total = 0.0;
    for (int i = 0; i < kProbes; ++i) {
      const double u = (i + 0.5) / kProbes;
      const brdf::SinCos theta_h(Angle::from_radians(theta_h_of(u)));
      for (const double td : kThetaDDeg) {
        for (const double pd : kPhiDDeg) {
          const brdf::ShadingGeometry g =
              brdf::shading_geometry(theta_h, brdf::SinCos(Angle::from_degrees(td)),
                                     brdf::SinCos(Angle::from_degrees(pd)));
          const double cosines = std::max(0.0, g.cos_theta_i) * std::max(0.0, g.cos_theta_o);
          own[static_cast<std::size_t>(i)] +=
              models[m]->evaluate(g).sum() * cosines * theta_h.sine * u;
        }
      }
      total += own[static_cast<std::size_t>(i)];
    }
    for (int i = 0; i < kProbes && total > 0.0; ++i) {
      density[static_cast<std::size_t>(i)] += own[static_cast<std::size_t>(i)] / total;
    }
  }
  double total = 0.0;
  for (const double d : density) total += d;

  std::vector<double> limits = {0.0};
  double reached = 0.0;
  for (int i = 0; i < kProbes; ++i) {
    const double even = 1.0 / kProbes;
    const double by_material = total > 0.0 ? density[static_cast<std::size_t>(i)] / total : even;
    const double step = kEvenShare * even + (1.0 - kEvenShare) * by_material;
    while (limits.size() < kStrata) {
      const double wanted = static_cast<double>(limits.size()) / kStrata;
      if (wanted > reached + step) break;
      limits.push_back((i + (wanted - reached) / step) / kProbes);
    }
    reached += step;
  }
  limits.push_back(1.0);
  return limits;
}

/// One half vector of the quadrature in the frame of the normal.
struct HalfSample {
  Eigen::Vector3d half;
  double solid_angle;
};

std::vector<HalfSample> half_samples(const std::vector<double>& limits) {
  std::vector<HalfSample> samples;
  for (std::size_t s = 0; s + 1 < limits.size(); ++s) {
    const double from = theta_h_of(limits[s]);
    const double to = theta_h_of(limits[s + 1]);
    if (to - from <= 0.0) continue;
    // The middle by area, so that rings around the pole are not biased outwards.
    const double cosine = 0.5 * (std::cos(from) + std::cos(to));
    const double sine = std::sqrt(std::max(0.0, 1.0 - cosine * cosine));
    const int turns = std::clamp(
        static_cast<int>(std::lround(2.0 * std::numbers::pi * sine / (1.4 * (to - from)))),
        kLeastTurns, kMostTurns);
    const double shift = std::fmod(kGoldenTurn * static_cast<double>(s), 1.0);
    const double cap = 2.0 * std::sin(0.5 * (to + from)) * std::sin(0.5 * (to - from));
    for (int t = 0; t < turns; ++t) {
      const double phi = 2.0 * std::numbers::pi * (t + shift) / turns;
      samples.push_back({{sine * std::cos(phi), sine * std::sin(phi), cosine},
                         2.0 * std::numbers::pi * cap / turns});
    }
  }
  return samples;
}

/// A reflection of a ring's point at azimuth 0: where it looks, and how much of it arrives.
struct Reflection {
  const Eigen::Array4f* studio_ring;
  int azimuth;          ///< in entries of the studio's rings
  std::size_t weights;  ///< where this reflection's weights begin, one per model
};

struct RingReflections {
  std::vector<Reflection> reflections;
  std::vector<Eigen::Array4f> weights;
};

RingReflections reflections_at(double radius, std::span<const brdf::BrdfModel* const> models,
                               const std::vector<HalfSample>& samples) {
  const Eigen::Vector3d normal(radius, 0.0, std::sqrt(std::max(0.0, 1.0 - radius * radius)));
  const Eigen::Vector3d tangent(normal.z(), 0.0, -normal.x());  // in the plane of normal and view
  RingReflections ring;
  for (const HalfSample& sample : samples) {
    const Eigen::Vector3d half = sample.half.x() * tangent +
                                 sample.half.y() * Eigen::Vector3d::UnitY() +
                                 sample.half.z() * normal;
    const double cos_theta_d = half.z();
    if (cos_theta_d <= 1e-4) continue;
    const Eigen::Vector3d wi = 2.0 * cos_theta_d * half - Eigen::Vector3d::UnitZ();
    const double cosine = wi.dot(normal);
    if (cosine <= 0.0) continue;
    const double solid_angle = 4.0 * cos_theta_d * sample.solid_angle;  // d wi = 4 cos d wh

    const std::size_t first = ring.weights.size();
    const brdf::ShadingGeometry geometry = geometry_at(normal, ViewedLight(wi));
    for (const brdf::BrdfModel* model : models) {
      const brdf::Rgb weight = model->evaluate(geometry) * (cosine * solid_angle);
      Eigen::Array4f packed = Eigen::Array4f::Zero();
      packed.head<3>() = weight.cast<float>();
      ring.weights.push_back(packed);
    }
    const double turn =
        std::atan2(wi.y(), wi.x()) / (2.0 * std::numbers::pi) * EnvironmentTable::kAzimuths;
    const int azimuth = static_cast<int>(std::lround(turn) + EnvironmentTable::kAzimuths) %
                        EnvironmentTable::kAzimuths;
    const auto theta = static_cast<float>(std::acos(std::clamp(wi.z(), -1.0, 1.0)));
    ring.reflections.push_back(
        {studio_table().ring(theta, static_cast<float>(std::sqrt(solid_angle))), azimuth, first});
  }
  return ring;
}

/// Radiance all along a ring, per model: kAzimuths / stride entries, entry i at azimuth i stride.
std::vector<std::vector<Eigen::Array4f>> radiance_along(const RingReflections& ring,
                                                        std::size_t models, int stride) {
  const int count = EnvironmentTable::kAzimuths / stride;
  std::vector<std::vector<Eigen::Array4f>> sums(
      models, std::vector<Eigen::Array4f>(static_cast<std::size_t>(count), Eigen::Array4f::Zero()));
  for (const Reflection& reflection : ring.reflections) {
    for (std::size_t m = 0; m < models; ++m) {
      const Eigen::Array4f weight = ring.weights[reflection.weights + m];
      Eigen::Array4f* sum = sums[m].data();
      int from = reflection.azimuth;
      for (int i = 0; i < count; ++i) {
        sum[i] += weight * reflection.studio_ring[from];
        from += stride;
        if (from >= EnvironmentTable::kAzimuths) from -= EnvironmentTable::kAzimuths;
      }
    }
  }
  return sums;
}

/// As fine as the pixels along the ring ask for.
int stride_at(double radius_px) {
  int stride = 1;
  while (stride < 16 &&
         EnvironmentTable::kAzimuths / (2 * stride) > 1.6 * 2.0 * std::numbers::pi * radius_px) {
    stride *= 2;
  }
  return stride;
}

}  // namespace

void render_studio(std::span<const brdf::BrdfModel* const> models, const SphereLayout& layout,
                   std::vector<SpherePicture>& pictures) {
  const std::vector<HalfSample> samples = half_samples(strata_of(models));
  // Rings half way into each pixel of the radius; the outermost one keeps clear of the horizon.
  const auto rings = static_cast<std::size_t>(std::ceil(layout.radius_px()));
  std::vector<std::vector<std::vector<Eigen::Array4f>>> along(rings);
  std::vector<int> strides(rings);
  studio_table();  // built here and not by whichever block comes first: it is parallel itself
  parallel::for_each_block(0, rings, 2, [&](std::size_t from, std::size_t to) {
    for (std::size_t ring = from; ring < to; ++ring) {
      const double radius_px = static_cast<double>(ring) + 0.5;
      const double radius =
          std::min(radius_px / layout.radius_px(), 1.0 - 0.4 / layout.radius_px());
      strides[ring] = stride_at(radius_px);
      along[ring] =
          radiance_along(reflections_at(radius, models, samples), models.size(), strides[ring]);
    }
  });

  const auto value_at = [&](std::size_t ring, std::size_t model, double turn) -> Eigen::Array4f {
    const std::vector<Eigen::Array4f>& values = along[ring][model];
    const double at = turn * static_cast<double>(values.size());
    const auto low = static_cast<std::size_t>(at) % values.size();
    const auto share = static_cast<float>(at - std::floor(at));
    return values[low] * (1.0F - share) + values[(low + 1) % values.size()] * share;
  };
  const auto size = static_cast<std::size_t>(layout.size());
  parallel::for_each_block(0, size, 16, [&](std::size_t from, std::size_t to) {
    for (std::size_t y = from; y < to; ++y) {
      for (std::size_t x = 0; x < size; ++x) {
        const std::size_t pixel = y * size + x;
        if (pictures.front().coverage[pixel] <= 0.0F) continue;
        const Eigen::Vector2d p =
            layout.on_disc(static_cast<double>(x) + 0.5, static_cast<double>(y) + 0.5);
        const double position =
            std::clamp(p.norm() * layout.radius_px() - 0.5, 0.0, static_cast<double>(rings - 1));
        const auto low = static_cast<std::size_t>(position);
        const std::size_t high = std::min(low + 1, rings - 1);
        const auto share = static_cast<float>(position - static_cast<double>(low));
        double turn = std::atan2(p.y(), p.x()) / (2.0 * std::numbers::pi);
        if (turn < 0.0) turn += 1.0;
        for (std::size_t m = 0; m < models.size(); ++m) {
          const Eigen::Array4f value =
              value_at(low, m, turn) * (1.0F - share) + value_at(high, m, turn) * share;
          pictures[m].radiance[pixel] += value.head<3>();
        }
      }
    }
  });
}

}  // namespace gonio::render
