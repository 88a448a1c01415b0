// Whether every pixel asks the BRDF for the right directions, shown by BRDFs that answer with them.

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <utility>

#include "worlds.h"

namespace gonio::sim {
namespace {

/// Answers with any function of the geometry.
class SpyBrdf final : public brdf::BrdfModel {
 public:
  using Answer = std::function<double(const brdf::ShadingGeometry&)>;
  explicit SpyBrdf(Answer answer) : answer_(std::move(answer)) {}

 private:
  brdf::Rgb evaluate_visible(const brdf::ShadingGeometry& geometry) const override {
    return brdf::Rgb::Constant(answer_(geometry));
  }
  Answer answer_;
};

/// DN of f = 1 under 4 W/m^2 at 1 ms: 0.39 * 205 * 4.
constexpr double kUnitDn = 319.8;

devices::Frame spy_picture(const std::vector<Angle>& joints, SpyBrdf::Answer answer,
                           bool collimated = true) {
  SimOptions options = ideal_options(0.5);
  options.rig.collimated_lamp = collimated;
  options.scene.sample = std::make_shared<SpyBrdf>(std::move(answer));
  SimGoniometer world(options);
  return picture(world, joints, 1ms);
}

// 80 px of 1381 are 3.315417 deg off the axis.

TEST(SimCameraDirections, PixelsLookAlongTheirOwnRays) {
  const auto frame = spy_picture({60.0_deg, 60.0_deg, 0.0_deg},
                                 [](const auto& geometry) { return geometry.cos_theta_o; });
  EXPECT_NEAR(centre_dn(frame), 0.5 * kUnitDn, kDn);
  // 40 px are 1.659059 deg: right of the axis the turned-away plate is seen under 61.659059 deg,
  // left of it under 58.340941 deg.
  EXPECT_NEAR(dn(frame, kCentreRow, kCentreColumn + 40) / kUnitDn, 0.474717, 0.003);
  EXPECT_NEAR(dn(frame, kCentreRow, kCentreColumn - 40) / kUnitDn, 0.524864, 0.003);
  EXPECT_NEAR(dn(frame, kCentreRow + 80, kCentreColumn) / kUnitDn, 0.5 * 0.998326, 0.003);
}

TEST(SimCameraDirections, PixelsSeeTheLampFromTheirOwnPlace) {
  // Facing a lamp almost ahead (7.5 deg): f = 1 + 100 (1 - cos theta_i), E of the pixel divides
  // out against a plain plate in the same light.
  const std::vector<Angle> facing{7.5_deg, 7.5_deg, 0.0_deg};
  const auto spied = spy_picture(
      facing, [](const auto& geometry) { return 1.0 + 100.0 * (1.0 - geometry.cos_theta_i); },
      false);
  const auto plain = spy_picture(
      facing, [](const auto&) { return 1.0; }, false);
  EXPECT_NEAR(centre_dn(spied) / centre_dn(plain), 1.0, 0.005);
  // 80 px up: 20.27516 mm above, tan = 0.04055031, 1 - cos = 0.000821147.
  const double ratio =
      dn(spied, kCentreRow - 80, kCentreColumn) / dn(plain, kCentreRow - 80, kCentreColumn);
  EXPECT_NEAR(ratio, 1.0821, 0.005);
}

TEST(SimCameraDirections, TiltUpIsPositivePhiD) {
  // b = a/2 and g = 30 deg: theta_h = 30, theta_d = 30, phi_d = +90 deg.
  const auto frame = spy_picture({60.0_deg, 30.0_deg, 30.0_deg}, [](const auto& geometry) {
    return 1.0 + 0.9 * geometry.sin_phi_d;
  });
  EXPECT_NEAR(centre_dn(frame) / kUnitDn, 1.9 * 0.75, 0.003);  // cos theta_i = cos 30 cos 30
}

TEST(SimCameraDirections, TurnTowardsTheLampIsPhiDOf180) {
  const auto frame = spy_picture({60.0_deg, 50.0_deg, 0.0_deg}, [](const auto& geometry) {
    return 1.0 - 0.9 * geometry.cos_phi_d;
  });
  EXPECT_NEAR(centre_dn(frame) / kUnitDn, 1.9 * 0.9848078, 0.003);  // theta_i = 10 deg
}

TEST(SimCameraDirections, HalfwayPoseHasTheNormalAsHalfVector) {
  const auto frame = spy_picture({60.0_deg, 30.0_deg, 0.0_deg}, [](const auto& geometry) {
    return 1.0 + geometry.sin_theta_h + 10.0 * (geometry.cos_theta_d - 0.8660254);
  });
  EXPECT_NEAR(centre_dn(frame) / kUnitDn, 0.8660254, 0.003);
}

// Lens distortion: the edge of a 20 mm sample at 350 mm stands at x = 0.05714286 on the plane
// z = 1, r^2 = 0.003265306, 78.914 px without distortion.

int last_lit_column(const devices::Frame& frame) {
  int column = frame.width_px - 1;
  while (dn(frame, kCentreRow, column) < 100.0) --column;
  return column - kCentreColumn;
}

int first_lit_column(const devices::Frame& frame) {
  int column = 0;
  while (dn(frame, kCentreRow, column) < 100.0) ++column;
  return column - kCentreColumn;
}

SimOptions small_sample() {
  SimOptions options = ideal_options(0.5);
  options.scene.white_patch = false;
  options.scene.sample_half_width_mm = 20.0;
  return options;
}

TEST(SimCameraDirections, RadialDistortionMovesTheImageOutwards) {
  SimOptions options = small_sample();
  options.camera.k1 = 5.0;
  options.camera.k2 = 100.0;
  SimGoniometer world(options);
  const auto frame = picture(world, {60.0_deg, 0.0_deg, 0.0_deg});
  // 78.914 (1 + 5 r^2 + 100 r^4) = 80.29 px
  EXPECT_EQ(last_lit_column(frame), 80);
  EXPECT_EQ(first_lit_column(frame), -80);
}

TEST(SimCameraDirections, TangentialDistortionShiftsBothEdgesTheSameWay) {
  SimOptions options = small_sample();
  options.camera.p2 = 0.5;
  SimGoniometer world(options);
  const auto frame = picture(world, {60.0_deg, 0.0_deg, 0.0_deg});
  // x + 3 p2 x^2: 85.68 and -72.15 px
  EXPECT_EQ(last_lit_column(frame), 85);
  EXPECT_EQ(first_lit_column(frame), -72);
}

TEST(SimCameraDirections, TangentialDistortionShiftsUpperAndLowerEdgeTheSameWay) {
  SimOptions options = small_sample();
  options.camera.p1 = 0.5;
  SimGoniometer world(options);
  const auto frame = picture(world, {60.0_deg, 0.0_deg, 0.0_deg});
  // y + 3 p1 y^2, down is positive: 85.68 and -72.15 px
  EXPECT_GT(dn(frame, kCentreRow + 85, kCentreColumn), 200.0);
  EXPECT_LT(dn(frame, kCentreRow + 86, kCentreColumn), 30.0);
  EXPECT_GT(dn(frame, kCentreRow - 72, kCentreColumn), 200.0);
  EXPECT_LT(dn(frame, kCentreRow - 73, kCentreColumn), 30.0);
}

TEST(SimCameraDirections, RefusesADistortionThatFoldsTheImage) {
  SimOptions options = small_sample();
  options.camera.k1 = -60.0;
  EXPECT_THROW(SimGoniometer{options}, std::invalid_argument);
}

}  // namespace
}  // namespace gonio::sim
