#include "gonio/calibration/radiometry/colour_matrix.h"

#include <gmock/gmock.h>

#include <Eigen/LU>
#include <algorithm>

#include "gonio/calibration/result/step_refused.h"
#include "gonio/random/stream.h"

namespace gonio::calibration {
namespace {

const Eigen::Matrix3d kTruth =
    (Eigen::Matrix3d() << 1.5, -0.4, -0.1, -0.2, 1.4, -0.2, 0.05, -0.45, 1.4).finished();

std::vector<ChartPatch> chart(double noise_level) {
  random::Stream noise(random::make_key(11, "chart"));
  std::vector<ChartPatch> patches;
  for (int i = 0; i < 24; ++i) {
    ChartPatch patch;
    for (int c = 0; c < 3; ++c) patch.target[c] = 0.05 + 0.85 * noise.uniform();
    patch.camera = kTruth.inverse() * patch.target;
    for (int c = 0; c < 3; ++c) patch.camera[c] *= 1.0 + noise_level * noise.normal();
    patches.push_back(patch);
  }
  return patches;
}

const Eigen::Vector3d kWhite = Eigen::Vector3d::Ones();

TEST(ColourMatrix, IsFound) {
  const ColourMatrix found = fit_colour_matrix(chart(0.0), kTruth.inverse() * kWhite, kWhite);
  EXPECT_TRUE(found.matrix.isApprox(kTruth, 1e-10));
  EXPECT_LT(found.max_delta_e, 1e-6);
}

TEST(ColourMatrix, KeepsTheWhiteWhateverTheNoise) {
  const Eigen::Vector3d camera_white = kTruth.inverse() * kWhite;
  const ColourMatrix found = fit_colour_matrix(chart(0.01), camera_white, kWhite);
  EXPECT_TRUE((found.matrix * camera_white).isApprox(kWhite, 1e-12));
  EXPECT_TRUE(found.matrix.isApprox(kTruth, 0.03));
  EXPECT_LT(found.mean_delta_e, 2.0);
  EXPECT_GT(found.mean_delta_e, 0.05);
}

TEST(ColourMatrix, TellsPatchByPatchWhatItIsOffBy) {
  auto patches = chart(0.0);
  patches[3].target += Eigen::Vector3d(0.05, 0.0, 0.0);  // a faded patch
  patches[3].weight = 1e-6;
  const ColourMatrix found = fit_colour_matrix(patches, kTruth.inverse() * kWhite, kWhite);
  ASSERT_EQ(found.patches.size(), patches.size());
  for (std::size_t i = 0; i < patches.size(); ++i) {
    EXPECT_EQ(found.patches[i].certified, patches[i].target);
    EXPECT_TRUE(found.patches[i].found.isApprox(kTruth * patches[i].camera, 1e-5));
    EXPECT_EQ(found.patches[i].delta_e < 0.01, i != 3) << i;
  }
  EXPECT_GT(found.patches[3].delta_e, 1.0);
  EXPECT_EQ(found.patches[3].delta_e, found.max_delta_e);
}

TEST(ColourMatrix, HeavyPatchesCountMore) {
  auto patches = chart(0.0);
  patches[3].target += Eigen::Vector3d(0.05, 0.0, 0.0);  // a faded patch
  const Eigen::Vector3d camera_white = kTruth.inverse() * kWhite;
  const double with_it = (fit_colour_matrix(patches, camera_white, kWhite).matrix - kTruth).norm();
  patches[3].weight = 1e-3;
  const double without = (fit_colour_matrix(patches, camera_white, kWhite).matrix - kTruth).norm();
  EXPECT_LT(without, 0.05 * with_it);
}

TEST(ColourMatrix, ChartUpsideDownIsRefused) {
  auto patches = chart(0.0);
  for (std::size_t i = 0; i < 12; ++i) std::swap(patches[i].target, patches[23 - i].target);
  EXPECT_THAT([&] { fit_colour_matrix(patches, kTruth.inverse() * kWhite, kWhite); },
              testing::ThrowsMessage<StepRefused>(testing::HasSubstr("right way up")));
}

TEST(ColourMatrix, GreysAndTooFewPatchesAreRefused) {
  std::vector<ChartPatch> greys;
  for (int i = 1; i < 12; ++i) {
    const Eigen::Vector3d grey = Eigen::Vector3d::Constant(0.08 * i);
    greys.push_back({kTruth.inverse() * grey, grey, 1.0});
  }
  EXPECT_THAT([&] { fit_colour_matrix(greys, kTruth.inverse() * kWhite, kWhite); },
              testing::ThrowsMessage<StepRefused>(testing::HasSubstr("one colour")));
  greys.resize(5);
  EXPECT_THAT([&] { fit_colour_matrix(greys, kTruth.inverse() * kWhite, kWhite); },
              testing::ThrowsMessage<StepRefused>(testing::HasSubstr("at least 6")));
}

}  // namespace
}  // namespace gonio::calibration
