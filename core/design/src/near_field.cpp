#include "gonio/design/near_field.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <stdexcept>
#include <string>

#include "gonio/brdf/merl_lattice.h"
#include "near_field_pixels.h"

namespace gonio::design {
namespace {

void require(bool ok, const char* field, double value, const char* expected) {
  if (!ok) {
    throw std::invalid_argument("near field: " + std::string(field) + " is " +
                                std::to_string(value) + ", expected " + expected);
  }
}

}  // namespace

void NearFieldSetup::validate() const {
  require(field_of_view > Angle() && field_of_view <= Angle::from_degrees(150.0), "field_of_view",
          field_of_view.degrees(), "above 0, at most 150 deg");
  require(image_px >= 1 && image_px <= 4096, "image_px", image_px, "1 to 4096");
  require(camera_distance_mm > 0.0 && std::isfinite(camera_distance_mm), "camera_distance_mm",
          camera_distance_mm, "above 0");
  require(lamp_distance_mm > 0.0, "lamp_distance_mm", lamp_distance_mm, "above 0");
  require(sample_half_width_mm > 0.0, "sample_half_width_mm", sample_half_width_mm, "above 0");
  require(theta_max > Angle() && theta_max < Angle::from_degrees(90.0), "theta_max",
          theta_max.degrees(), "above 0, below 90 deg");
}

NearFieldView near_field_view(const brdf::HalfDiff& centre, const NearFieldSetup& setup) {
  struct Sums {
    double theta_h = 0.0;
    double theta_d = 0.0;
    double phi_d = 0.0;
    int pixels = 0;
  };
  std::map<std::size_t, Sums> cells;
  NearFieldView view;
  for_each_usable_pixel(centre, setup, [&](const NearFieldPixel& pixel) {
    if (pixel.distance_mm > setup.sample_half_width_mm) return;
    brdf::HalfDiff at = brdf::half_diff_from_directions(pixel.directions);
    if (at.phi_d < Angle()) at.phi_d = at.phi_d + Angle::from_degrees(180.0);
    if (at.phi_d >= Angle::from_degrees(180.0)) at.phi_d = at.phi_d - Angle::from_degrees(180.0);
    Sums& sums = cells[brdf::lattice::cell_from_index(brdf::lattice::nearest_index(at))];
    sums.theta_h += at.theta_h.radians();
    sums.theta_d += at.theta_d.radians();
    sums.phi_d += at.phi_d.radians();
    ++sums.pixels;
    ++view.usable_pixels;
  });
  for (const auto& [cell, sums] : cells) {
    const double count = sums.pixels;
    const brdf::HalfDiff mean{Angle::from_radians(sums.theta_h / count),
                              Angle::from_radians(sums.theta_d / count),
                              Angle::from_radians(sums.phi_d / count), Angle()};
    // Right at the horizon the mean of some directions may lie below it.
    if (brdf::above_horizon(mean.theta_h, mean.theta_d, mean.phi_d)) {
      view.bins.push_back({mean, sums.pixels});
    }
  }
  return view;
}

double needed_half_width_mm(const brdf::HalfDiff& centre, const NearFieldSetup& setup,
                            double share) {
  std::vector<double> distances_mm;
  for_each_usable_pixel(centre, setup, [&](const NearFieldPixel& pixel) {
    distances_mm.push_back(pixel.distance_mm);
  });
  if (distances_mm.empty()) return 0.0;
  const double wanted = std::clamp(share, 0.0, 1.0) * static_cast<double>(distances_mm.size());
  const auto rank = static_cast<std::ptrdiff_t>(std::max(std::ceil(wanted), 1.0)) - 1;
  std::nth_element(distances_mm.begin(), distances_mm.begin() + rank, distances_mm.end());
  return distances_mm[static_cast<std::size_t>(rank)];
}

Eigen::MatrixXd near_field_information(const basis::BasisRows& rows, const NearFieldView& view,
                                       const PoseNoise& noise) {
  const double m = rows.basis().row_count();
  const Eigen::Index k = rows.basis().components.cols();
  Eigen::MatrixXd a(static_cast<Eigen::Index>(view.bins.size()), k);
  Eigen::VectorXd root(a.rows());  // of the precision of each bin
  for (Eigen::Index i = 0; i < a.rows(); ++i) {
    const NearFieldBin& bin = view.bins[static_cast<std::size_t>(i)];
    root[i] =
        1.0 / std::sqrt(noise.independent * noise.independent / bin.pixels + noise.model_eta / m);
    a.row(i) = root[i] * rows.at(bin.direction).q.transpose();
  }
  Eigen::MatrixXd information = Eigen::MatrixXd::Zero(k, k);
  information.selfadjointView<Eigen::Lower>().rankUpdate(a.transpose());
  const Eigen::VectorXd shared = a.transpose() * root;
  const double common = noise.common * noise.common;
  information.selfadjointView<Eigen::Lower>().rankUpdate(
      shared, -common / (1.0 + common * root.squaredNorm()));
  return Eigen::MatrixXd(information.selfadjointView<Eigen::Lower>()) / m;
}

double near_field_error(const basis::BasisRows& rows, const Eigen::MatrixXd& importance,
                        std::span<const brdf::HalfDiff> shots, const NearFieldSetup& setup,
                        const PoseNoise& noise) {
  const Eigen::Index k = importance.rows();
  Eigen::MatrixXd information = Eigen::MatrixXd::Identity(k, k);
  for (const brdf::HalfDiff& shot : shots) {
    information += near_field_information(rows, near_field_view(shot, setup), noise);
  }
  return information.llt().solve(importance).trace() / rows.basis().row_count();
}

}  // namespace gonio::design
