#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "bilinear_warp.h"
#include "gonio/brdf/rgl_file.h"
#include "gonio/errors/errors.h"
#include "gonio/parallel/parallel.h"

namespace gonio::brdf {
namespace {

/// A node at every bin centre of the lattice's theta_h, (2 i + 1) / 180 of the same square root.
constexpr std::size_t kPolarNodes = 181;
constexpr std::size_t kAzimuthNodes = 65;
constexpr std::size_t kLights = 31;
constexpr std::size_t kWarped = 64;
/// Closer to the horizon a lattice has no value; f is taken as constant from there on.
constexpr double kLowestCosine = 0.02;
/// f cos theta_o goes on below the horizon, so that cells the horizon cuts interpolate to the right
/// value above it; not far, because nothing reads it there.
constexpr double kBelowHorizon = -0.1;
/// Of the peak: keeps f cos theta_o over ndf in the range of single precision.
constexpr double kLowestNdf = 1e-7;

double theta_of(double u) { return u * u * std::numbers::pi / 2.0; }

double luminance(const Rgb& rgb) { return 0.2126 * rgb[0] + 0.7152 * rgb[1] + 0.0722 * rgb[2]; }

Rgb value_at(const BrdfModel& model, const DirectionPair& pair) {
  const Rgb value = model.evaluate(pair);
  if (!value.isFinite().all()) throw NumericalError("the BRDF model is not finite");
  return value.max(0.0);
}

/// The shape of the lobe over theta_h: mean of f cos theta_i cos theta_o over a few theta_d and
/// phi_d.
std::vector<double> lobe_of(const BrdfModel& model) {
  std::vector<double> lobe(kPolarNodes, 0.0);
  for (std::size_t i = 0; i < kPolarNodes; ++i) {
    const Angle theta_h = Angle::from_radians(theta_of(static_cast<double>(i) / (kPolarNodes - 1)));
    double sum = 0.0;
    int count = 0;
    for (const double theta_d : {3.0, 15.0, 30.0, 45.0, 60.0}) {
      for (double phi_d = 0.0; phi_d < 180.0; phi_d += 22.5) {
        const DirectionPair pair = directions_from_half_diff(
            {theta_h, Angle::from_degrees(theta_d), Angle::from_degrees(phi_d), Angle()});
        if (std::min(pair.wi.z(), pair.wo.z()) < kLowestCosine) continue;
        sum += luminance(value_at(model, pair)) * pair.wi.z() * pair.wo.z();
        ++count;
      }
    }
    // Hardly any direction at the very end: as before it.
    lobe[i] = count > 0 ? sum / count : lobe[std::max<std::size_t>(i, 1) - 1];
  }
  const double peak = *std::max_element(lobe.begin(), lobe.end());
  for (double& value : lobe) value = std::fmax(value, std::fmax(kLowestNdf * peak, 1e-12));
  return lobe;
}

/// Half vector at a node of the unit square, light in the plane of azimuth 0.
Eigen::Vector3d half_vector(double u, double v) {
  return direction(Angle::from_radians(theta_of(u)),
                   Angle::from_radians((2.0 * v - 1.0) * std::numbers::pi));
}

/// Area of the unit sphere per area of the unit square.
double sphere_per_square(double u) {
  return 2.0 * std::numbers::pi * std::sin(theta_of(u)) * std::numbers::pi * u;
}

/// Visible normals over the unit square: half by the lobe, half even. `area` gets the integral of
/// the lobe's projected area.
std::vector<double> visible_normals(const std::vector<double>& lobe, const Eigen::Vector3d& wi,
                                    double& area) {
  std::vector<double> density(kAzimuthNodes * kPolarNodes, 0.0);
  area = 0.0;
  for (std::size_t row = 0; row < kAzimuthNodes; ++row) {
    const double v = static_cast<double>(row) / (kAzimuthNodes - 1);
    for (std::size_t i = 0; i < kPolarNodes; ++i) {
      const double u = static_cast<double>(i) / (kPolarNodes - 1);
      const double facing = std::fmax(wi.dot(half_vector(u, v)), 0.0);
      const double value = lobe[i] * facing * sphere_per_square(u);
      density[row * kPolarNodes + i] = value;
      const double ends = (row == 0 || row == kAzimuthNodes - 1 ? 0.5 : 1.0) *
                          (i == 0 || i == kPolarNodes - 1 ? 0.5 : 1.0);
      area += ends * value / ((kAzimuthNodes - 1) * (kPolarNodes - 1));
    }
  }
  for (double& value : density) value = 0.5 * value / area + 0.5;
  return density;
}

}  // namespace

RglTables rgl_tables(const BrdfModel& model, std::string description) {
  RglTables tables;
  tables.description = std::move(description);
  for (std::size_t k = 0; k < kLights; ++k) {
    tables.theta_i_rad.push_back(
        static_cast<float>(std::numbers::pi / 2.0 * static_cast<double>(k) / (kLights - 1)));
  }
  const std::vector<double> lobe = lobe_of(model);
  tables.ndf = {2, kPolarNodes, std::vector<float>(lobe.begin(), lobe.end())};
  tables.sigma = {2, kPolarNodes, {}};
  for (std::size_t i = 0; i < kPolarNodes; ++i) {
    const double theta_i = theta_of(static_cast<double>(i) / (kPolarNodes - 1));
    double area = 0.0;
    visible_normals(lobe, direction(Angle::from_radians(theta_i), Angle()), area);
    tables.sigma.values.push_back(static_cast<float>(area));
  }
  for (RglTables::Grid* grid : {&tables.ndf, &tables.sigma}) {  // the same at both azimuths
    const std::vector<float> row = grid->values;
    grid->values.insert(grid->values.end(), row.begin(), row.end());
  }

  tables.vndf = {kAzimuthNodes, kPolarNodes, {}};
  for (const float theta_i : tables.theta_i_rad) {
    double area = 0.0;
    const std::vector<double> density =
        visible_normals(lobe, direction(Angle::from_radians(theta_i), Angle()), area);
    tables.vndf.values.insert(tables.vndf.values.end(), density.begin(), density.end());
  }
  const BilinearWarp warp(tables.vndf.values, kLights, kAzimuthNodes, kPolarNodes);

  constexpr std::size_t kPlane = kWarped * kWarped;
  tables.rgb = {kWarped, kWarped, std::vector<float>(kLights * 3 * kPlane)};
  parallel::for_each_block(0, kLights, 1, [&](std::size_t slice, std::size_t) {
    const double theta_i = std::fmin(tables.theta_i_rad[slice], std::acos(kLowestCosine));
    const Eigen::Vector3d wi = direction(Angle::from_radians(theta_i), Angle());
    const double sigma = bilinear(
        tables.sigma.values, kPolarNodes,
        AxisPlace::on(std::sqrt(tables.theta_i_rad[slice] * 2.0 / std::numbers::pi), kPolarNodes),
        {0, 0.5});
    for (std::size_t place = 0; place < kPlane; ++place) {
      const BilinearWarp::Point at =
          warp.from_uniform({static_cast<double>(place % kWarped) / (kWarped - 1),
                             static_cast<double>(place / kWarped) / (kWarped - 1)},
                            slice);
      const Eigen::Vector3d m = half_vector(at.x, at.y);
      Eigen::Vector3d wo = (2.0 * wi.dot(m) * m - wi).normalized();
      const double cosine = std::fmax(wo.z(), kBelowHorizon);
      if (wo.z() < kLowestCosine) {
        const double flat = std::hypot(wo.x(), wo.y());
        const double shrink =
            flat > 0.0 ? std::sqrt(1.0 - kLowestCosine * kLowestCosine) / flat : 0.0;
        wo = Eigen::Vector3d(wo.x() * shrink, wo.y() * shrink, kLowestCosine).normalized();
      }
      const double ndf =
          bilinear(tables.ndf.values, kPolarNodes, AxisPlace::on(at.x, kPolarNodes), {0, 0.5});
      const Rgb table = value_at(model, {wi, wo}) * (cosine * 4.0 * sigma / ndf);
      for (std::size_t channel = 0; channel < 3; ++channel) {
        tables.rgb.values[(3 * slice + channel) * kPlane + place] =
            static_cast<float>(table[static_cast<Eigen::Index>(channel)]);
      }
    }
  });
  return tables;
}

}  // namespace gonio::brdf
