#include <gtest/gtest.h>

#include <cmath>

#include "worlds.h"

namespace gonio::sim {
namespace {

// LA-2 with the camera at 350 mm on +x and the lamp at 500 mm; lamp_arm a, azimuth b, tilt g:
// cos theta_i = cos g cos(b - a), cos theta_o = cos g cos b. A lamp of 1 W/sr gives 4 W/m^2 on the
// sample's centre under normal incidence. In the ideal world (1e8 portions for one electron)
//   DN = 0.39 * 205000 * exposure * 4 cos theta_i * albedo / pi.
// At albedo 0.5 and 10 ms: 508.9884 cos theta_i (0.39 * 2050 * 2 / pi).
constexpr double kFacingDn = 508.9884;

TEST(SimCamera, SeesALambertianPlateByInverseSquareAndAlbedo) {
  SimGoniometer world(ideal_options(0.5));
  const auto frame = picture(world, {60.0_deg, 60.0_deg, 0.0_deg});
  EXPECT_NEAR(centre_dn(frame), kFacingDn, kDn);
}

TEST(SimCamera, SeesThePlateDarkenByTheCosineOfTheLightOnly) {
  SimGoniometer world(ideal_options(0.5));
  // theta_i = 0, 60, 60; theta_o = 60, 0, 60
  EXPECT_NEAR(centre_dn(picture(world, {60.0_deg, 60.0_deg, 0.0_deg})), kFacingDn, kDn);
  EXPECT_NEAR(centre_dn(picture(world, {60.0_deg, 0.0_deg, 0.0_deg})), 0.5 * kFacingDn, kDn);
  EXPECT_NEAR(centre_dn(picture(world, {10.0_deg, 10.0_deg, 60.0_deg})), 0.5 * kFacingDn, kDn);
}

TEST(SimCamera, SeesNothingOfASideTurnedAwayFromTheLight) {
  SimGoniometer world(ideal_options(0.5));
  EXPECT_NEAR(centre_dn(picture(world, {120.0_deg, 10.0_deg, 0.0_deg})), 0.0, kDn);
}

TEST(SimCamera, EveryPixelHasItsOwnDistanceToTheLamp) {
  // Plate facing the camera at 350 mm, f = 1381 px: 80 px left of the axis is 20.27516 mm on -y of
  // the world. The lamp at 60 deg stands at (250, 433.0127) mm: from there r^2 = 250^2 +
  // 453.28786^2 = 267969.89 mm^2, cos theta_i = 250 / r = 0.4829414; on the axis 0.25 m^2 and 0.5.
  SimGoniometer world(ideal_options(0.5));
  const auto frame = picture(world, {60.0_deg, 0.0_deg, 0.0_deg}, 40ms);
  const double left = frame.at(kCentreRow, kCentreColumn - 80) - frame.black_level_dn;
  constexpr double kExpected = 4.0 * kFacingDn * 0.4829414 * (250000.0 / 267969.89);
  EXPECT_NEAR(left, kExpected, 1.5);  // 0.5 + four sigmas at 917 DN, 0.2 DN
  EXPECT_NEAR(centre_dn(frame), 2.0 * kFacingDn, 1.5);
}

TEST(SimCamera, ImageUpIsWorldUpAndImageRightIsTheSamplesX) {
  SimOptions options = ideal_options(0.5);
  options.scene.patch_x_mm = 33.0;
  options.scene.patch_y_mm = 20.0;  // sample y = world z at the zero pose
  SimGoniometer world(options);
  const auto frame = picture(world, {60.0_deg, 0.0_deg, 0.0_deg});
  // f / 350 mm = 3.945714 px/mm: the patch is at +130 px right, 79 px up.
  const auto dn = [&](int row, int column) { return frame.at(row, column) - 64.0; };
  EXPECT_GT(dn(128 - 79, 160 + 130), 300.0);  // 99 % white, about 1.98 * 254 * farther out
  EXPECT_LT(dn(128 + 79, 160 + 130), 30.0);   // 3 % holder
  EXPECT_LT(dn(128 - 79, 160 - 130), 30.0);
}

TEST(SimCamera, SampleEndsWhereItsHalfWidthSays) {
  SimOptions options = ideal_options(0.5);
  options.scene.white_patch = false;
  options.scene.sample_half_width_mm = 20.0;
  options.scene.holder_half_width_mm = 30.0;
  SimGoniometer world(options);
  const auto frame = picture(world, {60.0_deg, 0.0_deg, 0.0_deg});
  const auto dn = [&](int column) { return frame.at(kCentreRow, column) - frame.black_level_dn; };
  // 20 mm = 78.914 px, 30 mm = 118.371 px
  EXPECT_GT(dn(160 + 78), 200.0);
  EXPECT_LT(dn(160 + 79), 30.0);
  EXPECT_GT(dn(160 + 118), 5.0);
  EXPECT_EQ(dn(160 + 119), 0.0);
  EXPECT_GT(dn(160 - 78), 200.0);
  EXPECT_LT(dn(160 - 79), 30.0);
}

TEST(SimCamera, FootprintWidensByTheCosineOfTheView) {
  SimOptions options = ideal_options(0.5);
  options.scene.white_patch = false;
  options.scene.holder_half_width_mm = 1.0;  // under the sample
  SimGoniometer world(options);
  // Turned by 60 deg about the vertical: edge at x = 27 mm lies 13.5 mm aside and 23.3827 mm
  // towards or away from the camera; 1381 * 13.5 / (350 -+ 23.3827) = 57.08 or 49.93 px.
  const auto frame = picture(world, {60.0_deg, 60.0_deg, 0.0_deg});
  const auto dn = [&](int column) { return frame.at(kCentreRow, column) - frame.black_level_dn; };
  int first = 0;
  while (dn(first) < 100.0) ++first;
  int last = 319;
  while (dn(last) < 100.0) --last;
  // The sample's +x side turns away from the camera (towards -x of the world).
  EXPECT_EQ(last - 160, 49);
  EXPECT_EQ(160 - first, 57);
}

TEST(SimCamera, TurningAStageChangesThePicture) {
  SimGoniometer world(ideal_options(0.5));
  const auto before = picture(world, {60.0_deg, 0.0_deg, 0.0_deg});
  const auto tilted = picture(world, {60.0_deg, 0.0_deg, 30.0_deg});
  EXPECT_NE(before.pixels_dn, tilted.pixels_dn);
  // cos theta_i = cos 30 cos 60 = 0.4330127
  EXPECT_NEAR(centre_dn(tilted), 0.4330127 * kFacingDn, kDn);
}

TEST(SimCamera, MountTiltTurnsTheNormal) {
  // At the zero pose the sample's y is the world's vertical: +10 deg about it turn the normal from
  // the camera towards the lamp, theta_i = 60 - 10.
  SimOptions options = ideal_options(0.5);
  options.sample_mount.tilt_about_y = 10.0_deg;
  SimGoniometer world(options);
  const auto frame = picture(world, {60.0_deg, 0.0_deg, 0.0_deg});
  EXPECT_NEAR(centre_dn(frame), 0.6427876 * kFacingDn, kDn);
}

TEST(SimCamera, MountHeightBringsTheSampleCloserToLampAndCamera) {
  // 50 mm towards a lamp straight ahead of it: (500/450)^2.
  SimOptions options = ideal_options(0.5);
  options.sample_mount.height_mm = 50.0;
  SimGoniometer world(options);
  const auto frame = picture(world, {10.0_deg, 10.0_deg, 0.0_deg});
  // The pixel on the axis no longer sees the point straight below the lamp: 50 tan 10 = 8.8 mm
  // aside, cos^3 of 1.12 deg = 0.99943.
  EXPECT_NEAR(centre_dn(frame), 1.2345679 * 0.99943 * kFacingDn, 1.0);
}

TEST(SimCamera, CollimatedLightFallsTheSameOnEveryPixel) {
  SimOptions options = ideal_options(0.5);
  options.rig.collimated_lamp = true;
  SimGoniometer world(options);
  const auto frame = picture(world, {60.0_deg, 0.0_deg, 0.0_deg});
  for (const int column : {80, 120, 160, 200, 240}) {
    EXPECT_NEAR(frame.at(kCentreRow, column) - frame.black_level_dn, 0.5 * kFacingDn, kDn);
  }
}

TEST(SimCamera, LampFieldFallsOffByTheTangentFromItsAxis) {
  SimOptions options = ideal_options(0.5);
  options.lamp.field = {0.0, 0.0, -50.0, 0.0, 0.0};
  SimGoniometer bent(options);
  SimGoniometer even(ideal_options(0.5));
  // Facing the lamp almost frontally (10 deg): 20.27516 mm aside on the sample's x is a tangent of
  // 0.0405503 in the horizontal direction of the lamp: 1 - 50 * 0.00164433 = 0.917784; on the
  // lamp's vertical nothing happens.
  const std::vector<Angle> facing{10.0_deg, 10.0_deg, 0.0_deg};
  const auto with = picture(bent, facing);
  const auto without = picture(even, facing);
  EXPECT_NEAR(centre_dn(with), centre_dn(without), kDn);
  // x' = 20.27516 mm seen under 10 deg: column offset f x cos10 / (350 - x sin10 ...) on the left
  // (near) side: 1381 * 19.96713 / 346.4793 = 79.585 px; nearest pixel centre 80: x' = 20.379 mm.
  const double ratio = (with.at(kCentreRow, 80) - 64.0) / (without.at(kCentreRow, 80) - 64.0);
  EXPECT_NEAR(ratio, 1.0 - 50.0 * std::pow(20.379 / 500.0, 2), 0.003);
  const double vertical =
      (with.at(48, kCentreColumn) - 64.0) / (without.at(48, kCentreColumn) - 64.0);
  EXPECT_NEAR(vertical, 1.0, 0.003);
}

TEST(SimCamera, LampFieldHasItsOwnRightAndDown) {
  SimOptions options = ideal_options(0.5);
  options.lamp.field = {2.0, 3.0, 0.0, 40.0, 0.0};
  SimGoniometer bent(options);
  SimGoniometer even(ideal_options(0.5));
  // The plate faces the lamp 7.5 deg aside, so the sample's x is the lamp's x and its y the lamp's
  // -y, 500 mm away. 80 px up is 20.2752 mm up; 80 px right is 20.6073 mm to the right, where 80 px
  // up is 20.4310 mm up.
  const std::vector<Angle> facing{7.5_deg, 7.5_deg, 0.0_deg};
  const auto with = picture(bent, facing, 40ms);
  const auto without = picture(even, facing, 40ms);
  const auto ratio = [&](int up, int right) {
    const int row = kCentreRow - up;
    const int column = kCentreColumn + right;
    return (with.at(row, column) - 64.0) / (without.at(row, column) - 64.0);
  };
  constexpr double kRatio = 0.0015;  // rounding and shot noise of two values near 2000 DN
  EXPECT_NEAR(ratio(80, 0), 1.0 - 3.0 * 0.0405503, kRatio);
  EXPECT_NEAR(ratio(-80, 0), 1.0 + 3.0 * 0.0405503, kRatio);
  EXPECT_NEAR(ratio(0, 80), 1.0 + 2.0 * 0.0412146, kRatio);
  EXPECT_NEAR(ratio(80, 80), 0.892479, kRatio);  // 1 + .082429 - .122586 - 40 * .0412146 * .040862
}

TEST(SimCamera, ChangerPutsTheWhiteTileInThePlane) {
  SimOptions options = ideal_options(0.05);
  SimGoniometer world(options);
  home(world);
  move_to(world, {60.0_deg, 60.0_deg, 0.0_deg});
  const auto start = world.clock().now();
  world.target_changer().mount(devices::Target::white);
  EXPECT_EQ(world.clock().now() - start, 20s);
  world.light_source().light("R");
  // albedo 0.99 instead of 0.5
  EXPECT_NEAR(centre_dn(world.camera().capture(10ms)), 1.98 * kFacingDn, 1.5);
}

TEST(SimCamera, InFramePatchIsWhite) {
  SimOptions options = ideal_options(0.5);
  options.scene.patch_x_mm = 0.0;
  options.scene.sample_half_width_mm = 1e-3;
  options.scene.patch_half_width_mm = 4.0;
  SimGoniometer world(options);
  const auto frame = picture(world, {60.0_deg, 60.0_deg, 0.0_deg});
  EXPECT_NEAR(frame.at(kCentreRow, kCentreColumn + 3) / 1.0 - 64.0, 1.98 * kFacingDn,
              0.01 * kFacingDn);
}

TEST(SimCamera, EachLampChannelShowsItsOwnColour) {
  SimOptions options = ideal_options(0.5);
  options.scene.sample = std::make_shared<brdf::Lambertian>(brdf::Rgb(0.5, 0.25, 0.1));
  SimGoniometer world(options);
  const std::vector<Angle> facing{60.0_deg, 60.0_deg, 0.0_deg};
  EXPECT_NEAR(centre_dn(picture(world, facing, 10ms, "R")), kFacingDn, kDn);
  EXPECT_NEAR(centre_dn(picture(world, facing, 10ms, "G")), 0.5 * kFacingDn, kDn);
  EXPECT_NEAR(centre_dn(picture(world, facing, 10ms, "B")), 0.2 * kFacingDn, kDn);
}

TEST(SimCamera, ExposureDuringAMoveAveragesOverTheWay) {
  // The plate turns its normal from 60 deg off the lamp to 0: the mean of cos theta_i over a
  // constant 20 deg/s, sin(60 deg) / (pi/3) = 0.8269933, lies well apart from both ends.
  SimOptions options = ideal_options(0.5);
  options.rig.axes[kAzimuth].max_speed_deg_per_s = 20.0;
  options.rig.axes[kAzimuth].acceleration_deg_per_s2 = 1e6;
  options.camera.responsivity_e_per_s /= 300.0;
  SimGoniometer world(options);
  home(world);
  move_to(world, {60.0_deg, 0.0_deg, 0.0_deg});
  world.light_source().light("G");
  world.stage(kAzimuth).begin_move_to(60.0_deg);
  EXPECT_NEAR(centre_dn(world.camera().capture(3s)), 0.8269933 * kFacingDn, 1.5);
}

TEST(SimCamera, BlurSpreadsAnEdgeAndKeepsTheSum) {
  SimOptions options = ideal_options(0.5);
  options.scene.white_patch = false;
  options.scene.holder_half_width_mm = 1.0;
  options.scene.sample_half_width_mm = 10.0;
  SimGoniometer sharp(options);
  options.camera.psf_sigma_px = 2.0;
  SimGoniometer soft(options);
  const std::vector<Angle> pose{60.0_deg, 0.0_deg, 0.0_deg};
  const auto a = picture(sharp, pose, 40ms);
  const auto b = picture(soft, pose, 40ms);
  double sum_a = 0.0;
  double sum_b = 0.0;
  for (std::size_t pixel = 0; pixel < a.pixels_dn.size(); ++pixel) {
    sum_a += a.pixels_dn[pixel] - 64.0;
    sum_b += b.pixels_dn[pixel] - 64.0;
  }
  EXPECT_NEAR(sum_b / sum_a, 1.0, 0.002);
  // The last pixel of the sample (39.46 px) is 160 + 39, so the edge lies at 39.5; 1.5 px or 0.75
  // sigma outside of it 22.66 % of the plateau are left.
  const double plateau = b.at(kCentreRow, 160 + 25) - 64.0;
  EXPECT_NEAR((b.at(kCentreRow, 160 + 41) - 64.0) / plateau, 0.2266, 0.005);
  EXPECT_EQ(a.at(kCentreRow, 160 + 41), 64);
}

}  // namespace
}  // namespace gonio::sim
