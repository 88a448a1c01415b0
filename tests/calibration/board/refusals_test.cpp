// Pictures of which no corners are made.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>

#include "gonio/calibration/board/detect.h"
#include "gonio/calibration/result/step_refused.h"
#include "pictures.h"

namespace gonio::calibration::board {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

void expect_refused(const devices::Frame& frame, const BoardSpec& spec, const char* found,
                    const char* advice) {
  EXPECT_THAT([&] { detect(test::image_of(frame), spec); },
              testing::ThrowsMessage<StepRefused>(AllOf(HasSubstr(found), HasSubstr("expected"),
                                                        HasSubstr(advice), Not(HasSubstr("\n")))));
}

TEST(DetectRefuses, AWhiteTileInThePlaceOfTheBoard) {
  const BoardSpec spec;
  const auto frame = test::picture_of(test::options_with_board(spec), {0.0, 0.0}, test::kExposure,
                                      test::Target::white);
  expect_refused(frame, spec, "no marker", "in the holder");
}

TEST(DetectRefuses, ABoardThatIsAnother) {
  const BoardSpec mounted;
  const auto frame = test::picture_of(test::options_with_board(mounted), {0.0, 0.0});
  BoardSpec asked;
  asked.first_marker = 100;
  EXPECT_THROW(detect(test::image_of(frame), asked), StepRefused);
}

TEST(DetectRefuses, ABoardOfWhichHalfIsHidden) {
  const BoardSpec spec;
  devices::Frame frame = test::picture_of(test::options_with_board(spec), {0.0, 0.0});
  for (int row = 0; row < frame.height_px; ++row) {
    for (int column = 300; column < frame.width_px; ++column) {
      frame.pixels_dn[static_cast<std::size_t>(row * frame.width_px + column)] = 90;
    }
  }
  expect_refused(frame, spec, "of 80 corners", "hidden");
}

TEST(DetectRefuses, AnEmptyPicture) {
  const BoardSpec spec;
  devices::Frame frame = test::picture_of(test::options_with_board(spec), {0.0, 0.0});
  frame.pixels_dn.assign(frame.pixels_dn.size(), 64);
  expect_refused(frame, spec, "0 DN between dark and bright", "lamp");
}

TEST(DetectRefuses, AnUnderexposedPicture) {
  const BoardSpec spec;
  const auto frame =
      test::picture_of(test::options_with_board(spec), {0.0, 0.0}, std::chrono::microseconds(100));
  expect_refused(frame, spec, "between dark and bright", "lamp");
}

TEST(DetectRefuses, AnOverexposedPicture) {
  const BoardSpec spec;
  const auto frame =
      test::picture_of(test::options_with_board(spec), {0.0, 0.0}, 4 * test::kExposure);
  expect_refused(frame, spec, "saturated", "expose less");
}

TEST(DetectRefuses, ABoardOfWhichTooFewCornersAreLeftOnceTheyAreFitted) {
  const BoardSpec spec;
  devices::Frame frame = test::picture_of(test::options_with_board(spec), {0.0, 0.0});
  const geometry::BoardView clean = detect(test::image_of(frame), spec);
  ASSERT_GT(clean.corners.size(), 72U);
  // Glints on every other corner: markers do not mind, and only half a per cent is saturated.
  for (const geometry::BoardCorner& corner : clean.corners) {
    if (corner.id % 2 != 0) continue;
    for (int y = -3; y <= 3; ++y) {
      for (int x = -3; x <= 3; ++x) {
        const auto column = static_cast<int>(std::lround(corner.pixel.x())) + x;
        const auto row = static_cast<int>(std::lround(corner.pixel.y())) + y;
        frame.pixels_dn[static_cast<std::size_t>(row * frame.width_px + column)] =
            frame.saturation_level_dn;
      }
    }
  }
  expect_refused(frame, spec, "of 80 corners fit to use", "among saturated or bad pixels");
}

TEST(DetectRefuses, PixelsThatDoNotMakeThePicture) {
  const BoardSpec spec;
  const std::vector<std::uint16_t> pixels(100, 500);
  const auto size = [&](int width, int height) {
    return [&pixels, &spec, width, height] { detect({pixels, width, height, 4095.0}, spec); };
  };
  EXPECT_THAT(size(10, 11), testing::ThrowsMessage<std::invalid_argument>(HasSubstr("10 x 11")));
  EXPECT_THROW(size(-10, -10)(), std::invalid_argument);
  EXPECT_THROW(size(0, 0)(), std::invalid_argument);
  const std::vector<std::uint8_t> mask(99, 0);
  EXPECT_THAT(
      [&] {
        detect({pixels, 10, 10, 4095.0, mask}, spec);
      },
      testing::ThrowsMessage<std::invalid_argument>(HasSubstr("mask of 99 pixels")));
}

}  // namespace
}  // namespace gonio::calibration::board
