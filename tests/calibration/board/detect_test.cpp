// Corners of the board in the simulator's pictures, against their projection.

#include "gonio/calibration/board/detect.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <vector>

#include "pictures.h"

namespace gonio::calibration::board {
namespace {

using test::Pose;

/// Deviations of the found corners from where they are.
struct Deviations {
  int count = 0;
  double sum_column = 0.0;
  double sum_row = 0.0;
  double sum_of_squares = 0.0;  ///< of the distances
  double largest_px = 0.0;

  void add(double column, double row) {
    ++count;
    sum_column += column;
    sum_row += row;
    sum_of_squares += column * column + row * row;
    largest_px = std::max(largest_px, std::hypot(column, row));
  }
  double rms_px() const { return std::sqrt(sum_of_squares / count); }
};

void add_view(Deviations& all, const geometry::BoardView& view, const sim::CameraOptions& camera,
              Pose pose) {
  for (const geometry::BoardCorner& corner : view.corners) {
    const auto truth = test::projected_px(camera, pose, corner.point_mm.x(), corner.point_mm.y());
    all.add(corner.pixel.x() - truth[0], corner.pixel.y() - truth[1]);
  }
}

constexpr int kCorners = 80;
constexpr double kMaxBias_px =
    0.005;  // of all views together: a shifted picture is a turned camera

void expect_corners(const std::vector<Pose>& poses, int min_corners, double max_rms_px) {
  const BoardSpec spec;
  const sim::SimOptions options = test::options_with_board(spec);
  Deviations all;
  for (const Pose& pose : poses) {
    const auto frame = test::picture_of(options, pose);
    const geometry::BoardView view = detect(test::image_of(frame), spec);
    Deviations here;
    add_view(here, view, options.camera, pose);
    add_view(all, view, options.camera, pose);
    EXPECT_GE(here.count, min_corners) << pose.azimuth_deg << ", " << pose.tilt_deg;
    EXPECT_LT(here.rms_px(), max_rms_px) << pose.azimuth_deg << ", " << pose.tilt_deg;
  }
  EXPECT_LT(std::abs(all.sum_column / all.count), kMaxBias_px);
  EXPECT_LT(std::abs(all.sum_row / all.count), kMaxBias_px);
}

// Bundle adjustment leaves out views slanted beyond 45 degrees. A marker that is missed costs up to
// four corners.
TEST(Detect, FindsTheCornersOfABoardThatFacesTheCamera) {
  expect_corners(
      {{0.0, 0.0}, {7.3, 0.0}, {-14.0, 9.0}, {20.0, -4.0}, {12.0, 21.0}, {0.0, 28.5}, {-28.0, 3.0}},
      kCorners - 8, 0.025);
}

TEST(Detect, FindsTheCornersOfASlantedBoard) {
  expect_corners({{38.0, 0.0}, {-33.0, 18.0}, {22.0, 35.0}, {0.0, 45.0}, {-44.5, 0.0}, {44.0, 5.0}},
                 kCorners - 25, 0.035);
}

// A picture that grows dimmer outwards must not draw its corners inwards: 0.005 % of their
// distances from the middle becomes 0.03 % of the focal length.
TEST(Detect, IsNotDrawnByFallingLight) {
  const BoardSpec spec;
  sim::SimOptions options = test::options_with_board(spec);
  options.camera.vignetting = {-5.0, 0.0, 0.0};  // 0.6 in the corner
  double outwards = 0.0;
  double squares = 0.0;
  for (const Pose pose : {Pose{7.3, 0.0}, {-14.0, 9.0}, {12.0, 21.0}, {-9.0, -3.0}}) {
    const auto frame = test::picture_of(options, pose);
    for (const geometry::BoardCorner& corner : detect(test::image_of(frame), spec).corners) {
      const auto truth =
          test::projected_px(options.camera, pose, corner.point_mm.x(), corner.point_mm.y());
      const double x = truth[0] - options.camera.cx_px;
      const double y = truth[1] - options.camera.cy_px;
      outwards += x * (corner.pixel.x() - truth[0]) + y * (corner.pixel.y() - truth[1]);
      squares += x * x + y * y;
    }
  }
  EXPECT_LT(std::abs(outwards / squares), 2e-5);
}

TEST(Detect, NumbersCornersRowByRowFromTheTopLeftAndCentresTheirPoints) {
  const BoardSpec spec;
  const auto frame = test::picture_of(test::options_with_board(spec), {7.3, 0.0});
  const geometry::BoardView view = detect(test::image_of(frame), spec);
  std::set<int> ids;
  for (const geometry::BoardCorner& corner : view.corners) {
    ids.insert(corner.id);
    EXPECT_EQ(corner.point_mm.x(), 10.0 * (corner.id % 10) - 45.0) << corner.id;
    EXPECT_EQ(corner.point_mm.y(), 35.0 - 10.0 * (corner.id / 10)) << corner.id;
  }
  ASSERT_EQ(ids.size(), 80U);
  EXPECT_EQ(*ids.begin(), 0);
  EXPECT_EQ(*ids.rbegin(), 79);
}

TEST(Detect, LeavesOutHiddenCorners) {
  const BoardSpec spec;
  const sim::SimOptions options = test::options_with_board(spec);
  devices::Frame frame = test::picture_of(options, {5.0, 5.0});
  constexpr int kHiddenBelow = 360;  // a finger across the lower rows
  for (int row = kHiddenBelow; row < frame.height_px; ++row) {
    for (int column = 0; column < frame.width_px; ++column) {
      frame.pixels_dn[static_cast<std::size_t>(row * frame.width_px + column)] = 90;
    }
  }
  const geometry::BoardView view = detect(test::image_of(frame), spec);
  Deviations seen;
  add_view(seen, view, options.camera, {5.0, 5.0});
  EXPECT_GT(seen.count, 48);
  EXPECT_LT(seen.count, kCorners);
  EXPECT_LT(seen.largest_px, 0.2) << "none is made up behind the finger";
}

TEST(Detect, LeavesOutCornersAtTheEdgeOfThePicture) {
  const BoardSpec spec;
  sim::SimOptions options = test::options_with_board(spec);
  options.camera.cx_px = 489.6;  // the eighth column of corners comes to 3 px from the edge
  const auto frame = test::picture_of(options, {0.0, 0.0});
  Deviations seen;
  add_view(seen, detect(test::image_of(frame), spec), options.camera, {0.0, 0.0});
  EXPECT_GE(seen.count, 56);
  EXPECT_LE(seen.count, 64);
  EXPECT_LT(seen.largest_px, 0.2);
}

TEST(Detect, SeesADimBoard) {
  const BoardSpec spec;
  const sim::SimOptions options = test::options_with_board(spec);
  const auto frame = test::picture_of(options, {10.0, 10.0}, test::kExposure / 8);
  Deviations seen;
  add_view(seen, detect(test::image_of(frame), spec), options.camera, {10.0, 10.0});
  EXPECT_GE(seen.count, kCorners - 8);
  EXPECT_LT(seen.rms_px(), 0.06);
}

TEST(Detect, BearsAnOverexposedCorner) {
  const BoardSpec spec;
  sim::SimOptions options = test::options_with_board(spec);
  devices::Frame frame = test::picture_of(options, {10.0, 10.0});
  for (int row = 0; row < 55; ++row) {  // a reflection in the margin: 1 % of the picture
    for (int column = 0; column < 55; ++column) {
      frame.pixels_dn[static_cast<std::size_t>(row * frame.width_px + column)] =
          frame.saturation_level_dn;
    }
  }
  Deviations seen;
  add_view(seen, detect(test::image_of(frame), spec), options.camera, {10.0, 10.0});
  EXPECT_GE(seen.count, kCorners - 4);
  EXPECT_LT(seen.rms_px(), 0.03);
}

/// By how much corners moved from one view of a picture to another, px: the largest.
double largest_move(const geometry::BoardView& from, const geometry::BoardView& to) {
  double largest = 0.0;
  for (const geometry::BoardCorner& corner : from.corners) {
    for (const geometry::BoardCorner& other : to.corners) {
      if (corner.id == other.id) largest = std::max(largest, (corner.pixel - other.pixel).norm());
    }
  }
  return largest;
}

// A window has some hundred pixels for eleven unknowns: two that are missing move a corner by less
// than its noise of 0.015 px.
constexpr double kMoveByTwoMissing_px = 0.015;

/// Index of a pixel so many rows and columns from the one that a corner lies in.
std::size_t beside(const geometry::BoardCorner& corner, const devices::Frame& frame, int rows,
                   int columns) {
  const auto row = static_cast<int>(std::lround(corner.pixel.y())) + rows;
  const auto column = static_cast<int>(std::lround(corner.pixel.x())) + columns;
  return static_cast<std::size_t>(row * frame.width_px + column);
}

TEST(Detect, BadPixelsBesideCornersMoveNone) {
  const BoardSpec spec;
  devices::Frame frame = test::picture_of(test::options_with_board(spec), {7.3, 6.0});
  const geometry::BoardView clean = detect(test::image_of(frame), spec);
  std::vector<std::uint8_t> bad(frame.pixels_dn.size(), 0);
  for (const geometry::BoardCorner& corner : clean.corners) {  // one hot and one dead at each
    const auto hot = beside(corner, frame, 2, 1);
    const auto dead = beside(corner, frame, -1, 2);
    frame.pixels_dn[hot] = 3800;
    frame.pixels_dn[dead] = 70;
    bad[hot] = bad[dead] = 1;
  }
  BoardImage image = test::image_of(frame);
  image.bad_pixels = bad;
  const geometry::BoardView masked = detect(image, spec);
  EXPECT_EQ(masked.corners.size(), clean.corners.size());
  EXPECT_LT(largest_move(clean, masked), kMoveByTwoMissing_px);
}

TEST(Detect, BadPixelsBesideCornersThatNoMapKnowsMoveNone) {
  const BoardSpec spec;
  devices::Frame frame = test::picture_of(test::options_with_board(spec), {7.3, 6.0});
  const geometry::BoardView clean = detect(test::image_of(frame), spec);
  for (const geometry::BoardCorner& corner : clean.corners) {
    const auto dead = beside(corner, frame, -1, 2);
    const bool in_white = frame.pixels_dn[dead] > 1000;
    frame.pixels_dn[dead] = in_white ? 70 : 2500;
  }
  const geometry::BoardView found = detect(test::image_of(frame), spec);
  EXPECT_GE(found.corners.size() + 2, clean.corners.size());
  EXPECT_LT(largest_move(clean, found), kMoveByTwoMissing_px);
}

TEST(Detect, SaturatedPixelsBesideCornersMoveNone) {
  const BoardSpec spec;
  devices::Frame frame = test::picture_of(test::options_with_board(spec), {7.3, 6.0});
  const geometry::BoardView clean = detect(test::image_of(frame), spec);
  for (const geometry::BoardCorner& corner : clean.corners) {
    frame.pixels_dn[beside(corner, frame, 2, 1)] = frame.saturation_level_dn;
  }
  const geometry::BoardView found = detect(test::image_of(frame), spec);
  EXPECT_EQ(found.corners.size(), clean.corners.size());
  EXPECT_LT(largest_move(clean, found), kMoveByTwoMissing_px);
}

TEST(Detect, GivesTheSameCornersAgain) {
  const BoardSpec spec;
  const auto frame = test::picture_of(test::options_with_board(spec), {-20.0, 12.0});
  const geometry::BoardView first = detect(test::image_of(frame), spec);
  const geometry::BoardView second = detect(test::image_of(frame), spec);
  ASSERT_EQ(first.corners.size(), second.corners.size());
  for (std::size_t i = 0; i < first.corners.size(); ++i) {
    EXPECT_EQ(first.corners[i].id, second.corners[i].id);
    EXPECT_EQ(first.corners[i].pixel, second.corners[i].pixel);
  }
}

}  // namespace
}  // namespace gonio::calibration::board
