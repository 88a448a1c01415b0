// What the calibration's targets look like in the camera.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numbers>

#include "worlds.h"

namespace gonio::sim {
namespace {

using devices::Target;

// LA-2 with the camera at 350 mm on +x, f = 1381 px, centre (160, 128); lamp 500 mm away.
constexpr double kFocalPx = 1381.0;
constexpr double kCameraMm = 350.0;
constexpr double kLampMm = 500.0;

devices::Frame picture_of(const SimOptions& options, Target target,
                          const std::vector<Angle>& joints, std::chrono::nanoseconds exposure) {
  SimGoniometer world(options);
  home(world);
  world.target_changer().mount(target);
  return picture(world, joints, exposure);
}

/// A plain world whose sensor takes the lamp's image too, and nothing else that is bright.
SimOptions options_for_images() {
  SimOptions options = ideal_options(0.5);
  options.camera.full_well_e *= 1000.0;
  options.scene.white_patch = false;
  return options;
}

// 0.39 DN * 205000 /s * 50 us / (pi * (2.5 mm)^2): the lamp itself.
constexpr double kLampDn = 3.9975 / (std::numbers::pi * 6.25e-6);

struct Spot {
  double column;
  double row;
  double sum_dn;
  double peak_dn;
};

Spot brightest(const devices::Frame& frame) {
  Spot spot{0.0, 0.0, 0.0, 0.0};
  for (int row = 0; row < frame.height_px; ++row) {
    for (int column = 0; column < frame.width_px; ++column) {
      spot.peak_dn = std::max(spot.peak_dn, dn(frame, row, column));
    }
  }
  for (int row = 0; row < frame.height_px; ++row) {
    for (int column = 0; column < frame.width_px; ++column) {
      const double value = dn(frame, row, column);
      if (value < 0.02 * spot.peak_dn) continue;
      spot.sum_dn += value;
      spot.column += value * column;
      spot.row += value * row;
    }
  }
  spot.column /= spot.sum_dn;
  spot.row /= spot.sum_dn;
  return spot;
}

/// Where a camera at (350, 0, 0) sees the image of a lamp behind a plane through the origin, by
/// reflecting the lamp in the plane and drawing the line.
std::array<double, 2> image_px(double lamp_arm_deg, double azimuth_deg, double tilt_deg) {
  constexpr double kDeg = std::numbers::pi / 180.0;
  const std::array<double, 3> lamp{kLampMm * std::cos(lamp_arm_deg * kDeg),
                                   kLampMm * std::sin(lamp_arm_deg * kDeg), 0.0};
  const std::array<double, 3> normal{std::cos(tilt_deg * kDeg) * std::cos(azimuth_deg * kDeg),
                                     std::cos(tilt_deg * kDeg) * std::sin(azimuth_deg * kDeg),
                                     std::sin(tilt_deg * kDeg)};
  const double depth = lamp[0] * normal[0] + lamp[1] * normal[1] + lamp[2] * normal[2];
  const double x = lamp[0] - 2.0 * depth * normal[0];
  const double y = lamp[1] - 2.0 * depth * normal[1];
  const double z = lamp[2] - 2.0 * depth * normal[2];
  const double away = kCameraMm - x;
  return {160.0 + kFocalPx * y / away, 128.0 - kFocalPx * z / away};
}

TEST(Board, EdgesLieWhereTheCameraProjectsThem) {
  SimOptions options = ideal_options(0.5);
  BoardOptions& board = options.scene.board;
  board.columns = 2;
  board.rows = 2;
  board.white = {true, false, false, true};
  board.cell_mm = 12.0;
  board.x_mm = 3.3;
  board.y_mm = -2.1;
  const auto frame = picture_of(options, Target::board, {30.0_deg, 0.0_deg, 0.0_deg}, 20ms);
  // Top left and bottom right are white. Across an edge the covered share adds up to its place.
  const auto edge = [&](bool along_row, int line, int from, int to) {
    const auto value = [&](int at) {
      return along_row ? dn(frame, line, at) : dn(frame, at, line);
    };
    double covered = 0.0;
    for (int at = from; at <= to; ++at) {
      const double share = static_cast<double>(at - from) / (to - from);
      const double white = value(from) + share * (value(to) * 0.85 / 0.04 - value(from));
      const double black = white * 0.04 / 0.85;
      covered += (value(at) - black) / (white - black);
    }
    return from - 0.5 + covered;
  };
  const double column = 160.0 + 3.3 * kFocalPx / kCameraMm;
  const double row = 128.0 + 2.1 * kFocalPx / kCameraMm;
  EXPECT_NEAR(edge(true, 118, static_cast<int>(column) - 3, static_cast<int>(column) + 4), column,
              0.05);
  EXPECT_NEAR(edge(false, 150, static_cast<int>(row) - 3, static_cast<int>(row) + 4), row, 0.05)
      << "the second column is black above and white below";
}

TEST(Board, EdgesMoveByAsLittleAsTheBoardDoes) {
  // The share of black in the pixel of an edge along rows, and along columns.
  const auto covered = [](double x_mm, double y_mm, int row, int column) {
    SimOptions options = ideal_options(0.5);
    BoardOptions& board = options.scene.board;
    board.columns = board.rows = 1;
    board.white = {false};
    board.cell_mm = 20.0;
    board.x_mm = x_mm;
    board.y_mm = y_mm;
    const auto frame = picture_of(options, Target::board, {30.0_deg, 0.0_deg, 0.0_deg}, 45ms);
    const bool edge_along_column = row == 128;
    const double black =
        edge_along_column ? dn(frame, row, column - 1) : dn(frame, row + 1, column);
    const double white = black * 0.85 / 0.04;
    return (white - dn(frame, row, column)) / (white - black);
  };
  // The right and the upper edge, `share` of the way through pixel column 200 and row 88.
  const double px_mm = kCameraMm / kFocalPx;
  for (const double share : {0.06, 0.2, 0.31, 0.45, 0.55, 0.69, 0.83, 0.94}) {
    const double x_mm = (39.5 + share) * px_mm - 10.0;
    const double y_mm = (39.5 + share) * px_mm - 10.0;
    // Half a step of the rays; black of 180 DN, rounded, from which white is made; shading.
    constexpr double kTolerance = 0.5 / 26 + 0.004;
    EXPECT_NEAR(covered(x_mm, y_mm, 128, 200), share, kTolerance);
    EXPECT_NEAR(covered(x_mm, y_mm, 88, 160), share, kTolerance);
  }
}

TEST(Board, ItsMarginIsWhiteAndTheHolderLiesAround) {
  SimOptions options = ideal_options(0.5);
  options.scene.white_patch = false;
  BoardOptions& board = options.scene.board;
  board.columns = board.rows = 1;
  board.white = {false};
  board.cell_mm = 20.0;
  board.margin_mm = 5.0;
  const auto frame = picture_of(options, Target::board, {30.0_deg, 0.0_deg, 0.0_deg}, 20ms);
  const double centre = dn(frame, 128, 160);
  EXPECT_NEAR(dn(frame, 128, 160 + 49) / centre, 0.85 / 0.04, 1.0);  // 12.4 mm
  EXPECT_LT(dn(frame, 128, 160 + 65) / centre, 1.0);                 // 16.5 mm, 3 %
}

TEST(Mirror, ShowsTheLampWhereTheLawOfReflectionSays) {
  const SimOptions options = options_for_images();
  for (const auto& pose : {std::array{60.0, 30.0, 0.0}, std::array{60.0, 30.9, -0.7},
                           std::array{100.0, 49.2, 0.8}, std::array{20.0, 10.3, 0.4}}) {
    const auto frame = picture_of(
        options, Target::mirror,
        {Angle::from_degrees(pose[0]), Angle::from_degrees(pose[1]), Angle::from_degrees(pose[2])},
        400us);
    const auto expected = image_px(pose[0], pose[1], pose[2]);
    const Spot spot = brightest(frame);
    EXPECT_NEAR(spot.column, expected[0], 0.05) << pose[0];
    EXPECT_NEAR(spot.row, expected[1], 0.05) << pose[0];
  }
}

TEST(Mirror, HasTheLampsRadianceAndItsDisc) {
  const SimOptions options = options_for_images();
  const Spot spot =
      brightest(picture_of(options, Target::mirror, {60.0_deg, 30.0_deg, 0.0_deg}, 1ms));
  EXPECT_NEAR(spot.peak_dn, 20.0 * kLampDn * 0.002, 3.0);
  // The disc across the line of sight, 850 mm away.
  const double radius_px = kFocalPx * 2.5 / (kCameraMm + kLampMm);
  EXPECT_NEAR(spot.sum_dn / spot.peak_dn, std::numbers::pi * radius_px * radius_px, 0.8);
}

TEST(Mirror, CanLieTiltedInItsMount) {
  SimOptions options = options_for_images();
  options.mounts[Target::mirror].tilt_about_y =
      0.4_deg;  // turns the normal towards +x of the sample
  const Spot tilted =
      brightest(picture_of(options, Target::mirror, {60.0_deg, 30.0_deg, 0.0_deg}, 1ms));
  const auto expected = image_px(60.0, 30.4, 0.0);
  EXPECT_NEAR(tilted.column, expected[0], 0.05);
  EXPECT_NEAR(tilted.row, expected[1], 0.05);
}

TEST(Mirror, TurnedLeansTheOtherWay) {
  SimOptions options = options_for_images();
  options.mounts[Target::mirror].tilt_about_y = 0.4_deg;
  options.mounts[Target::mirror].tilt_about_x = 0.2_deg;
  const rig::Joints pose{60.0_deg, 30.0_deg, 0.0_deg};
  const Spot one_way = brightest(picture_of(options, Target::mirror, pose, 1ms));
  const Spot turned = brightest(picture_of(options, Target::mirror_turned, pose, 1ms));
  const auto flat = image_px(60.0, 30.0, 0.0);
  EXPECT_GT(std::abs(one_way.column - flat[0]), 5.0);
  EXPECT_GT(std::abs(one_way.row - flat[1]), 3.0);
  EXPECT_NEAR(0.5 * (one_way.column + turned.column), flat[0], 0.1);
  EXPECT_NEAR(0.5 * (one_way.row + turned.row), flat[1], 0.1);
}

TEST(Board, TurnedIsUpsideDown) {
  SimOptions options = options_for_images();
  options.scene.board.columns = 2;
  options.scene.board.rows = 1;
  options.scene.board.white = {true, false};
  options.scene.board.cell_mm = 20.0;
  const rig::Joints pose{30.0_deg, 0.0_deg, 0.0_deg};
  const auto side_sum = [&](Target target, bool left) {
    const devices::Frame frame = picture_of(options, target, pose, 10ms);
    double sum = 0.0;
    for (int row = 0; row < frame.height_px; ++row) {
      for (int column = 0; column < frame.width_px; ++column) {
        if ((column < frame.width_px / 2) == left) sum += frame.at(row, column);
      }
    }
    return sum;
  };
  EXPECT_GT(side_sum(Target::board, true), side_sum(Target::board, false));
  EXPECT_LT(side_sum(Target::board_turned, true), side_sum(Target::board_turned, false));
}

TEST(BlackGlass, ReflectsAsFresnelSays) {
  SimOptions options = options_for_images();
  // n = 1.52, unpolarised, to five places from a table of Fresnel's equations.
  const std::array<std::array<double, 2>, 3> table{
      {{30.0, 0.04414}, {56.7, 0.07849}, {70.0, 0.17471}}};
  for (const auto& [theta_deg, reflectance] : table) {
    const std::vector<Angle> joints{Angle::from_degrees(2.0 * theta_deg),
                                    Angle::from_degrees(theta_deg), 0.0_deg};
    // The disc's centre alone: its rim is seen at other angles, where Fresnel's curve is steep.
    const double glass = centre_dn(picture_of(options, Target::black_glass, joints, 50us));
    EXPECT_NEAR(glass / kLampDn, reflectance, 0.002 * reflectance) << theta_deg;
  }
}

/// Brightest pixel at Brewster's angle, with a polariser along the device's x axis and across it.
std::array<double, 2> at_brewsters_angle(const std::function<void(SimOptions&, Angle)>& polarise) {
  std::array<double, 2> peak{};
  for (int turn = 0; turn < 2; ++turn) {
    SimOptions options = options_for_images();
    polarise(options, Angle::from_degrees(90.0 * turn));
    peak[turn] =
        brightest(picture_of(options, Target::black_glass, {113.32_deg, 56.66_deg, 0.0_deg}, 50us))
            .peak_dn;
  }
  std::sort(peak.begin(), peak.end());
  return peak;
}

TEST(BlackGlass, SwallowsLightPolarisedInThePlaneAtBrewstersAngle) {
  const auto peak = at_brewsters_angle([](SimOptions& options, Angle direction) {
    options.lamp.polarisation = 1.0;
    options.lamp.polarisation_direction = direction;
  });
  EXPECT_NEAR(peak[1] / kLampDn, 0.1569, 0.001);  // all of it across the plane
  EXPECT_LT(peak[0] / kLampDn, 1e-4);             // dust
}

TEST(BlackGlass, PolarisedCameraSeesThatTheReflectionIsPolarised) {
  const auto peak = at_brewsters_angle([](SimOptions& options, Angle direction) {
    options.camera.polarisation = 0.5;
    options.camera.polarisation_direction = direction;
  });
  EXPECT_NEAR(peak[1] / peak[0], 3.0, 0.02);  // 1 +- 0.5 of the mean
}

TEST(BlackTrap, IsDark) {
  const auto frame =
      picture_of(ideal_options(0.5), Target::black_trap, {60.0_deg, 30.0_deg, 0.0_deg}, 40ms);
  // A 50 % plate has 508.99 DN in 10 ms under normal incidence; theta_i = 30.
  const double expected = 4.0 * 508.9884 * std::cos(std::numbers::pi / 6.0) * 0.0005 / 0.5;
  EXPECT_NEAR(centre_dn(frame), expected, 0.6);
}

TEST(ColourChart, EveryPatchHasItsColourAndBlackBetween) {
  SimOptions options = ideal_options(0.5);
  options.scene.colour_chart.columns = 3;
  options.scene.colour_chart.albedos = {{0.1, 0.2, 0.3}, {0.2, 0.4, 0.1}, {0.9, 0.8, 0.7},
                                        {0.5, 0.1, 0.2}, {0.3, 0.6, 0.3}, {0.7, 0.1, 0.1}};
  SimGoniometer world(options);
  home(world);
  world.target_changer().mount(Target::colour_chart);
  const auto frame = picture(world, {10.0_deg, 5.0_deg, 0.0_deg}, 20ms);  // G
  const double mm = kFocalPx / kCameraMm;
  const auto at = [&](double x_mm, double y_mm) {
    return dn(frame, static_cast<int>(std::lround(128.0 - y_mm * mm)),
              static_cast<int>(std::lround(160.0 + x_mm * mm)));
  };
  const double left = at(-9.0, 4.5);
  EXPECT_NEAR(at(0.0, 4.5) / left, 0.4 / 0.2, 0.1);  // to its right, some more light
  EXPECT_NEAR(at(9.0, 4.5) / left, 0.8 / 0.2, 0.3);
  EXPECT_NEAR(at(0.0, -4.5) / left, 0.6 / 0.2, 0.1);  // below
  EXPECT_LT(at(4.5, 4.5) / left, 0.3);                // the gap
}

TEST(TargetOptions, NameWhatIsWrong) {
  const auto refused = [](const auto& spoil, const char* says) {
    SimOptions options = ideal_options(0.5);
    spoil(options);
    EXPECT_THAT([&] { options.validate(); },
                testing::ThrowsMessage<std::invalid_argument>(testing::HasSubstr(says)));
  };
  refused([](SimOptions& o) { o.scene.board.columns = -2; }, "scene.board.columns");
  refused([](SimOptions& o) { o.scene.board.columns = o.scene.board.rows = 2; },
          "scene.board.white");
  refused([](SimOptions& o) { o.scene.black_glass.refractive_index = 0.5; },
          "black_glass.refractive");
  refused([](SimOptions& o) { o.scene.mirror.reflectance = 2.0; }, "scene.mirror.reflectance");
  refused([](SimOptions& o) { o.scene.colour_chart.albedos = {{0.1, 2.0, 0.1}}; }, "albedos");
  refused([](SimOptions& o) { o.lamp.radius_mm = 0.0; }, "lamp.radius_mm");
  refused([](SimOptions& o) { o.lamp.polarisation = 1.5; }, "lamp.polarisation");
  refused([](SimOptions& o) { o.camera.polarisation = -0.1; }, "camera.polarisation");
  refused([](SimOptions& o) { o.mounts[Target::mirror].tilt_about_x = 60.0_deg; },
          "mounts.mirror.tilt_about_x");
}

}  // namespace
}  // namespace gonio::sim
