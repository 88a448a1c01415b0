#include "gonio/design/image_importance.h"

#include <gtest/gtest.h>

#include <cmath>

#include "gonio/design/candidates.h"
#include "gonio/design/importance.h"
#include "gonio/parallel/parallel.h"

namespace gonio::design {
namespace {

constexpr double kPictureSum = 1e-3;  // single-precision sums over thousands of terms

/// Two grey materials that hardly differ, and components with a meaning: everything brighter, only
/// what nobody sees (light below 0.3 deg over the horizon), and only near the mirror direction.
basis::Basis plain_basis(float mirror_gain) {
  basis::Basis basis;
  basis.materials = {{"a", "", ""}, {"b", "", ""}};
  const auto p = static_cast<Eigen::Index>(basis_cell_count());
  basis.mean.resize(p);
  basis.components.setZero(p, 3);
  for (Eigen::Index i = 0; i < p; ++i) {
    const brdf::HalfDiff at = direction_of_basis_cell(static_cast<std::uint32_t>(i));
    const brdf::PolarCosines cosines = brdf::polar_cosines(at.theta_h, at.theta_d, at.phi_d);
    const bool mirror = at.theta_h < Angle::from_degrees(1.5);
    const double f = mirror ? 0.2 * static_cast<double>(mirror_gain) : 0.2;
    basis.mean[i] = static_cast<float>(basis.mapping.forward(f, basis.mapping.weight(cosines)));
    basis.components(i, 0) = 1.0F;
    basis.components(i, 1) = cosines.cos_theta_i < 0.005 ? 1.0F : 0.0F;
    basis.components(i, 2) = mirror ? 1.0F : 0.0F;
  }
  return basis;
}

Eigen::MatrixXd no_left_vectors() { return Eigen::MatrixXd::Zero(6, 3); }

TEST(ImageImportance, IsWhatAPictureOfAGreySphereShows) {
  const Eigen::MatrixXd importance = image_importance(plain_basis(1.0F), no_left_vectors());
  // All BRDF values larger by a share c: a display value v with power 1/2.2 becomes v (1 + c/2.2),
  // nine tenths of the values lie below 0.8^(1/2.2) = 0.90, the brightest are at 1 or clipped.
  const double mean_square_display = importance(0, 0) * 2.2 * 2.2;
  EXPECT_GT(mean_square_display, 0.1);
  EXPECT_LT(mean_square_display, 0.9);
  // A pixel takes the nearest cell, whose centre may lie a little lower than what it sees.
  EXPECT_LT(importance(1, 1), 1e-5 * importance(0, 0)) << "light nobody sees";
  EXPECT_GT(importance(2, 2), 0.0);
  EXPECT_LT(importance(2, 2), importance(0, 0));
  EXPECT_LT((importance - importance.transpose()).norm(), 1e-12);
}

TEST(ImageImportance, ClippedHighlightsSayNothing) {
  const double dull = image_importance(plain_basis(3.0F), no_left_vectors())(2, 2);
  const double blinding = image_importance(plain_basis(1e5F), no_left_vectors())(2, 2);
  EXPECT_LT(blinding, 0.5 * dull);
}

TEST(ImageImportance, GivesTheSameBytesForAnySeedAndThreads) {
  const basis::Basis basis = plain_basis(1.0F);
  ImageImportanceOptions options;
  options.scenes = 2;
  parallel::set_thread_count(1);
  const Eigen::MatrixXd one = image_importance(basis, no_left_vectors(), options);
  parallel::set_thread_count(3);
  const Eigen::MatrixXd three = image_importance(basis, no_left_vectors(), options);
  parallel::set_thread_count(0);
  EXPECT_EQ(one, three);
  options.seed = 2;
  EXPECT_NE(image_importance(basis, no_left_vectors(), options), one);
}

TEST(BlendedImportance, MixesPartsOfEqualWeight) {
  const basis::Basis basis = plain_basis(1.0F);
  const Eigen::MatrixXd solid_angle = blended_importance(basis, {}, {0.0, 0.0});
  const Eigen::MatrixXd image = blended_importance(basis, no_left_vectors(), {0.0, 1.0});
  EXPECT_NEAR(image.trace() / solid_angle.trace(), 1.0, kPictureSum);
  const Eigen::MatrixXd mixed = blended_importance(basis, no_left_vectors(), {0.25, 0.25});
  const Eigen::MatrixXd uniform = blended_importance(basis, {}, {1.0, 0.0});
  const Eigen::MatrixXd expected = 0.5 * solid_angle + 0.25 * image + 0.25 * uniform;
  EXPECT_LT((mixed - expected).norm(), kPictureSum * expected.norm());
  EXPECT_EQ(blended_importance(basis, {}, {0.1, 0.0}),
            importance_matrix(basis.components, importance_weights({0.1})));
}

TEST(BlendedImportance, RefusesSharesBeyondTheWhole) {
  const basis::Basis basis = plain_basis(1.0F);
  EXPECT_THROW(blended_importance(basis, no_left_vectors(), {0.6, 0.6}), std::invalid_argument);
  EXPECT_THROW(blended_importance(basis, no_left_vectors(), {-0.1, 0.0}), std::invalid_argument);
  EXPECT_THROW(blended_importance(basis, {}, {0.0, 1.0}), std::invalid_argument);
}

}  // namespace
}  // namespace gonio::design
