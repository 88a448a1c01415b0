#include "gonio/instrument/camera_model.h"

#include <gtest/gtest.h>

#include "gonio/errors/errors.h"

namespace gonio::instrument {
namespace {

const CameraModel kDistorted{.width_px = 612,
                             .height_px = 512,
                             .fx_px = 1381.0,
                             .fy_px = 1379.0,
                             .cx_px = 310.0,
                             .cy_px = 250.0,
                             .k1 = -0.12,
                             .k2 = 0.05,
                             .p1 = 4e-4,
                             .p2 = -3e-4};

TEST(CameraModel, LooksAlongItsAxisAtThePrincipalPoint) {
  const Eigen::Vector3d ray = kDistorted.ray(310.0, 250.0);
  EXPECT_NEAR((ray - Eigen::Vector3d::UnitZ()).norm(), 0.0, 1e-15);
}

TEST(CameraModel, PutsPositiveXAtHigherColumnsAndPositiveYAtHigherRows) {
  const CameraModel camera{.width_px = 100,
                           .height_px = 100,
                           .fx_px = 200.0,
                           .fy_px = 100.0,
                           .cx_px = 49.5,
                           .cy_px = 49.5};
  const Eigen::Vector2d pixel = camera.project({1.0, 2.0, 10.0});
  EXPECT_NEAR(pixel.x(), 49.5 + 20.0, 1e-12);
  EXPECT_NEAR(pixel.y(), 49.5 + 20.0, 1e-12);
}

TEST(CameraModel, ProjectsItsOwnRaysBackToTheirPixels) {
  constexpr double kRoundTrip_px = 2e-9;  // 1e-12 of the focal length of 1,400 px
  for (double row = 0.0; row <= 511.0; row += 73.0) {
    for (double column = 0.0; column <= 611.0; column += 47.0) {
      const Eigen::Vector2d pixel = kDistorted.project(350.0 * kDistorted.ray(column, row));
      EXPECT_NEAR(pixel.x(), column, kRoundTrip_px);
      EXPECT_NEAR(pixel.y(), row, kRoundTrip_px);
    }
  }
}

TEST(CameraModel, RefusesAPixelItsDistortionCannotReach) {
  CameraModel camera = kDistorted;
  camera.k1 = -5.0;
  EXPECT_THROW(camera.ray(3000.0, 3000.0), NumericalError);
}

TEST(CameraModel, RefusesAPointBehindTheCamera) {
  EXPECT_THROW(kDistorted.project({0.0, 0.0, -1.0}), std::invalid_argument);
}

}  // namespace
}  // namespace gonio::instrument
