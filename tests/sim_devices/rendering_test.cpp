// Pictures as they are rendered, against the plain way: every place of every pixel by as many rays
// as an edge gets, all of it blurred.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "gonio/parallel/parallel.h"
#include "gonio/sim/angular_white.h"
#include "gonio/sim/hidden_options.h"
#include "radiance.h"
#include "worlds.h"

namespace gonio::sim {
namespace {

using devices::Target;

// Of what a pixel shows. The noise of a full pixel, 10,000 electrons, is 1e-2.
constexpr double kFarBelowNoise = 2e-5;
// A pixel between bright and dark is compared with what is around it, not with its own darkness.
constexpr double kDarkest = 0.01;
// Nobody looks for edges between the last middles and the end of the picture.
constexpr int kRim_px = 4;

struct Way {
  int parts;  // of a pixel's edge
  int rays;
  int step;
};
constexpr Way kOneRay{1, 1, 1};
constexpr Way kInPixels{1, 34, 21};
constexpr Way kInQuarters{2, 13, 8};

/// The hidden world at a quarter of the pixels, its middle.
SimOptions small_world() {
  SimOptions options =
      hidden_options(std::make_shared<brdf::Lambertian>(brdf::Rgb(0.5, 0.4, 0.3)), 3);
  options.camera.width_px = 300;
  options.camera.height_px = 240;
  options.camera.cx_px = 151.3;
  options.camera.cy_px = 118.6;
  BoardOptions& board = options.scene.board;
  board.columns = 16;
  board.rows = 12;
  board.cell_mm = 4.0;
  for (int cell = 0; cell < board.columns * board.rows; ++cell) {
    board.white.push_back((cell * 7 / 3 + cell / board.columns) % 2 == 0);
  }
  options.scene.black_glass.filter = 1.0;
  options.validate();
  return options;
}

/// One band, as the header of this file says.
std::vector<double> plainly(const RadianceRenderer& renderer, const SimOptions& options,
                            const rig::Joints& joints, Target target, const Way& way, int band) {
  const TargetView view = renderer.view(joints, target);
  const int width = options.camera.width_px * way.parts;
  const int height = options.camera.height_px * way.parts;
  std::vector<double> places(static_cast<std::size_t>(width) * height);
  parallel::for_each_block(0, height, 4, [&](std::size_t begin, std::size_t end) {
    for (int row = static_cast<int>(begin); row < static_cast<int>(end); ++row) {
      for (int column = 0; column < width; ++column) {
        double sum = 0.0;
        for (int i = 0; i < way.rays; ++i) {
          const double x = (i + 0.5) / way.rays - 0.5;
          const double y = (i * way.step % way.rays + 0.5) / way.rays - 0.5;
          const Eigen::Vector2d ray = renderer.lens().ray_in(
              row / way.parts, column / way.parts, (column % way.parts + 0.5 + x) / way.parts - 0.5,
              (row % way.parts + 0.5 + y) / way.parts - 0.5);
          const Eigen::Vector3d along = view.direction(ray);
          sum += view.radiance_at(view.place_along(along), along)[band];
        }
        places[static_cast<std::size_t>(row) * width + column] = sum / way.rays;
      }
    }
  });
  const double sigma = options.camera.psf_sigma_px * way.parts;
  const int reach = static_cast<int>(std::ceil(4.0 * sigma));
  const auto weight = [&](int away) { return std::exp(-0.5 * away * away / (sigma * sigma)); };
  double whole = 0.0;
  for (int away = -reach; away <= reach; ++away) whole += weight(away);
  const auto blurred = [&](const std::vector<double>& from, bool along_rows) {
    std::vector<double> to(from.size());
    for (int row = 0; row < height; ++row) {
      for (int column = 0; column < width; ++column) {
        double sum = 0.0;
        for (int away = -reach; away <= reach; ++away) {
          const int r = along_rows ? row : std::clamp(row + away, 0, height - 1);
          const int c = along_rows ? std::clamp(column + away, 0, width - 1) : column;
          sum += weight(away) / whole * from[static_cast<std::size_t>(r) * width + c];
        }
        to[static_cast<std::size_t>(row) * width + column] = sum;
      }
    }
    return to;
  };
  const std::vector<double> soft = blurred(blurred(places, true), false);
  std::vector<double> pixels(soft.size() / (way.parts * way.parts));
  for (int row = 0; row < height; ++row) {
    for (int column = 0; column < width; ++column) {
      pixels[static_cast<std::size_t>(row / way.parts) * options.camera.width_px +
             column / way.parts] +=
          soft[static_cast<std::size_t>(row) * width + column] / (way.parts * way.parts);
    }
  }
  return pixels;
}

void expect_as_plainly(const SimOptions& options, const rig::Joints& joints, Target target,
                       const Way& way) {
  RadianceRenderer renderer(options);
  for (int band = 0; band < 3; ++band) {
    Bands bands{};
    bands[band] = true;
    const auto image = renderer.render(joints, target, bands);
    const auto expected = plainly(renderer, options, joints, target, way, band);
    const double brightest = *std::max_element(expected.begin(), expected.end());
    ASSERT_GT(brightest, 0.0);
    double worst = 0.0;
    std::size_t worst_pixel = 0;
    const int width = options.camera.width_px;
    for (std::size_t pixel = 0; pixel < expected.size(); ++pixel) {
      const int column = static_cast<int>(pixel) % width;
      const int row = static_cast<int>(pixel) / width;
      if (std::min(column, row) < kRim_px || column >= width - kRim_px ||
          row >= options.camera.height_px - kRim_px) {
        continue;
      }
      const double difference = std::abs(image->planes[band][pixel] - expected[pixel]) /
                                std::max(expected[pixel], kDarkest * brightest);
      if (difference > worst) {
        worst = difference;
        worst_pixel = pixel;
      }
    }
    EXPECT_LT(worst, kFarBelowNoise)
        << "band " << band << ", row " << worst_pixel / options.camera.width_px << ", column "
        << worst_pixel % options.camera.width_px;
    ::testing::Test::RecordProperty("worst_difference_ppb", static_cast<int>(1e9 * worst));
  }
}

TEST(Rendering, OfABoardIsThatOfAllItsQuartersOfPixels) {
  const SimOptions options = small_world();
  expect_as_plainly(options, {15.0_deg, -31.0_deg, 22.0_deg}, Target::board, kInQuarters);
  expect_as_plainly(options, {15.0_deg, 41.0_deg, 3.0_deg}, Target::board_turned, kInQuarters);
}

TEST(Rendering, OfALampInAMirrorIsThatOfManyRaysInEveryPixel) {
  expect_as_plainly(small_world(), {60.0_deg, 30.2_deg, 0.3_deg}, Target::mirror, kInPixels);
}

TEST(Rendering, OfALampInGlassIsThatOfManyRaysInEveryPixel) {
  expect_as_plainly(small_world(), {100.0_deg, 50.0_deg, 0.0_deg}, Target::black_glass, kInPixels);
}

TEST(Rendering, OfAChartIsThatOfManyRaysInEveryPixel) {
  expect_as_plainly(small_world(), {45.0_deg, 10.0_deg, 5.0_deg}, Target::colour_chart, kInPixels);
}

TEST(Rendering, OfPlainTargetsIsThatOfOneRayInEveryPixel) {
  const SimOptions options = small_world();
  expect_as_plainly(options, {70.0_deg, 12.0_deg, 8.0_deg}, Target::sample, kOneRay);
  expect_as_plainly(options, {50.0_deg, 20.0_deg, 2.0_deg}, Target::white, kOneRay);
  expect_as_plainly(options, {50.0_deg, 20.0_deg, 2.0_deg}, Target::black_trap, kOneRay);
}

TEST(Rendering, OfACollimatedLampIsThatOfOneRayInEveryPixel) {
  SimOptions options = small_world();
  options.rig.collimated_lamp = true;
  expect_as_plainly(options, {70.0_deg, 12.0_deg, 8.0_deg}, Target::sample, kOneRay);
}

TEST(Rendering, OfAPlaneSeenFromBehindOrLitFromBehindIsBlackToTheLastPixel) {
  const SimOptions options = small_world();
  RadianceRenderer renderer(options);
  for (const rig::Joints& joints :
       {rig::Joints{60.0_deg, 120.0_deg, 0.0_deg}, rig::Joints{100.0_deg, -30.0_deg, 0.0_deg}}) {
    const auto image = renderer.render(joints, Target::sample, {true, true, true});
    for (const std::vector<float>& plane : image->planes) {
      EXPECT_EQ(*std::max_element(plane.begin(), plane.end()), 0.0F);
    }
  }
}

TEST(Rendering, KeepsAnImageThatIsHeldWhileOthersAreRendered) {
  RadianceRenderer renderer(small_world());
  const auto held =
      renderer.render({30.0_deg, 0.0_deg, 0.0_deg}, Target::sample, {false, true, false});
  const std::vector<float> before = held->planes[1];
  for (int i = 1; i < 12; ++i) {
    renderer.render({Angle::from_degrees(30.0 + 5 * i), 0.0_deg, 0.0_deg}, Target::sample,
                    {false, true, false});
  }
  EXPECT_EQ(held->planes[1], before);
}

TEST(Rendering, AddsABandToAPoseThatIsKept) {
  const SimOptions options = small_world();
  const rig::Joints joints{30.0_deg, 10.0_deg, 0.0_deg};
  RadianceRenderer at_once(options);
  RadianceRenderer one_by_one(options);
  const auto all = at_once.render(joints, Target::sample, {true, true, true});
  one_by_one.render(joints, Target::sample, {true, false, false});
  const auto added = one_by_one.render(joints, Target::sample, {false, false, true});
  EXPECT_EQ(added->planes[0], all->planes[0]);
  EXPECT_EQ(added->planes[2], all->planes[2]);
}

}  // namespace
}  // namespace gonio::sim
