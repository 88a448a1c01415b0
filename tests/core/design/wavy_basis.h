#pragma once

#include <Eigen/Core>
#include <cmath>

#include "gonio/basis/basis.h"
#include "gonio/brdf/merl_lattice.h"
#include "gonio/parallel/parallel.h"
#include "gonio/random/stream.h"

namespace gonio::design {

constexpr int kComponents = 6;

/// A made-up basis over the whole lattice: waves of the angles, amplitudes falling as singular
/// values do, so that neighbouring directions tell similar things.
inline const basis::Basis& wavy_basis() {
  static const basis::Basis basis = [] {
    const auto& cells = brdf::lattice::cells_above_horizon();
    basis::Basis made;
    made.materials.resize(10);
    made.mean = Eigen::VectorXf::Zero(static_cast<Eigen::Index>(cells.size()));
    made.components.resize(made.mean.size(), kComponents);
    made.singular_values = Eigen::VectorXd::Ones(29);
    random::Stream draw(random::make_key(5, "test.wavy_basis"));
    Eigen::MatrixXd waves(kComponents, 4);
    for (Eigen::Index j = 0; j < kComponents; ++j) {
      for (Eigen::Index c = 0; c < 4; ++c) waves(j, c) = 6.0 * draw.uniform();
    }
    parallel::for_each_block(0, cells.size(), 4096, [&](std::size_t from, std::size_t to) {
      for (std::size_t i = from; i < to; ++i) {
        const brdf::HalfDiff at =
            brdf::lattice::angles_of(brdf::lattice::index_from_cell(cells[i]));
        const double t = std::sqrt(at.theta_h.radians());
        for (Eigen::Index j = 0; j < kComponents; ++j) {
          made.components(static_cast<Eigen::Index>(i), j) = static_cast<float>(
              5.0 * std::pow(0.7, static_cast<double>(j)) *
              std::sin(waves(j, 0) * t + waves(j, 1) * at.theta_d.radians() +
                       waves(j, 2) * std::cos(2.0 * at.phi_d.radians()) + waves(j, 3)));
        }
      }
    });
    return made;
  }();
  return basis;
}

inline const Eigen::MatrixXd& importance() {
  static const Eigen::MatrixXd matrix = [] {
    const Eigen::MatrixXd q = wavy_basis().components.topRows(20000).cast<double>();
    return Eigen::MatrixXd(q.transpose() * q / 20000.0);
  }();
  return matrix;
}

}  // namespace gonio::design
