#include "some_basis.h"

#include <cmath>
#include <string>

#include "gonio/design/candidates.h"
#include "gonio/parallel/parallel.h"
#include "gonio/random/distributions.h"
#include "gonio/random/key.h"

namespace gonio::bench {

const basis::Basis& some_basis() {
  static const basis::Basis made = [] {
    basis::Basis basis;
    for (int i = 0; i < kMaterials; ++i) basis.materials.push_back({std::to_string(i), "", ""});
    const auto p = static_cast<Eigen::Index>(design::basis_cell_count());
    basis.mean.resize(p);
    basis.components.resize(p, kComponents);
    const random::Key key = random::make_key(1, "benchmark.basis");
    Eigen::ArrayXXf waves(kComponents, 4);
    for (Eigen::Index j = 0; j < waves.size(); ++j) {
      waves(j) = static_cast<float>(4.0 * random::normal(key, static_cast<std::uint64_t>(j)));
    }
    const Eigen::ArrayXf height =
        3.0F / Eigen::ArrayXf::LinSpaced(kComponents, 1.0F, static_cast<float>(kComponents));
    parallel::for_each_block(
        0, static_cast<std::size_t>(p), 4096, [&](std::size_t from, std::size_t to) {
          for (std::size_t i = from; i < to; ++i) {
            const auto row = static_cast<Eigen::Index>(i);
            const brdf::HalfDiff at =
                design::direction_of_basis_cell(static_cast<std::uint32_t>(i));
            const auto h = static_cast<float>(std::sqrt(at.theta_h.radians()));
            const auto d = static_cast<float>(at.theta_d.radians());
            const auto a = static_cast<float>(std::cos(2.0 * at.phi_d.radians()));
            basis.mean[row] = -2.0F - 2.0F * h;
            basis.components.row(row) =
                ((waves.col(0) * h + waves.col(1) * d + waves.col(2) * a + waves.col(3)).sin() *
                 height)
                    .matrix()
                    .transpose();
          }
        });
    Eigen::MatrixXd left(3 * kMaterials, kComponents);
    for (Eigen::Index j = 0; j < left.size(); ++j) {
      left(j) =
          random::normal(key, 100000 + static_cast<std::uint64_t>(j)) / std::sqrt(3.0 * kMaterials);
    }
    basis.left_vectors = left.rowwise() - left.colwise().mean();
    basis.singular_values = Eigen::VectorXd::LinSpaced(3 * kMaterials - 1, 3000.0, 1.0);
    return basis;
  }();
  return made;
}

}  // namespace gonio::bench
