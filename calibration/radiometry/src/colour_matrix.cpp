#include "gonio/calibration/radiometry/colour_matrix.h"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>

#include "gonio/calibration/result/step_refused.h"
#include "gonio/render/colour.h"

namespace gonio::calibration {
namespace {

constexpr std::size_t kMinPatches = 6;
// Eigenvalues of the weighted moment matrix: a grey scale has 1e-4 and less.
constexpr double kMinSpan = 2e-4;

/// A colour as sRGB can show it.
render::Lab shown(const Eigen::Vector3d& linear_srgb) {
  return render::lab_from_linear_srgb(linear_srgb.array().max(0.0).min(1.0));
}

}  // namespace

ColourMatrix fit_colour_matrix(const std::vector<ChartPatch>& patches,
                               const Eigen::Vector3d& camera_white,
                               const Eigen::Vector3d& target_white, double limit) {
  if (patches.size() < kMinPatches) {
    throw StepRefused(
        fmt::format("found {} patches, expected at least {}", patches.size(), kMinPatches));
  }
  if (!camera_white.allFinite() || !(camera_white.minCoeff() > 0.0) || !target_white.allFinite()) {
    throw StepRefused("found a white that is not positive, expected light in all three colours");
  }
  Eigen::Matrix3d moments = Eigen::Matrix3d::Zero();
  Eigen::Matrix3d cross = Eigen::Matrix3d::Zero();  // target * camera^T
  for (std::size_t i = 0; i < patches.size(); ++i) {
    const ChartPatch& patch = patches[i];
    if (!patch.camera.allFinite() || !patch.target.allFinite() || !(patch.weight > 0.0)) {
      throw StepRefused(
          fmt::format("patch {}: found a value that is not finite or no weight, expected both", i));
    }
    moments += patch.weight * patch.camera * patch.camera.transpose();
    cross += patch.weight * patch.target * patch.camera.transpose();
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> span(moments);
  if (!(span.eigenvalues()[0] > kMinSpan * span.eigenvalues()[2])) {
    throw StepRefused(
        "found patches of nearly one colour, expected a chart of many: is it in view?");
  }
  // min sum w |M c - t|^2 with M c_w = t_w: the unconstrained solution and a correction of rank
  // one.
  const Eigen::LDLT<Eigen::Matrix3d> solver(moments);
  const Eigen::Matrix3d free = solver.solve(cross.transpose()).transpose();
  const Eigen::Vector3d direction = solver.solve(camera_white);
  ColourMatrix result;
  result.matrix = free + (target_white - free * camera_white) * direction.transpose() /
                             camera_white.dot(direction);

  for (const ChartPatch& patch : patches) {
    const Eigen::Vector3d found = result.matrix * patch.camera;
    const double difference = render::delta_e_2000(shown(found), shown(patch.target));
    result.patches.push_back({patch.target, found, difference});
    result.mean_delta_e += difference / static_cast<double>(patches.size());
    result.max_delta_e = std::max(result.max_delta_e, difference);
  }
  if (!(result.mean_delta_e <= limit)) {
    throw StepRefused(fmt::format(
        "found a mean colour difference of {:.1f} (CIEDE2000), expected at most {:.1f}: is it this "
        "chart, and the right way up?",
        result.mean_delta_e, limit));
  }
  return result;
}

}  // namespace gonio::calibration
