// The printed board.

#include "gonio/calibration/board/board_spec.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <stdexcept>
#include <string>

namespace gonio::calibration::board {
namespace {

/// A square as text, '#' for black.
std::string square_of(const BoardCells& cells, const BoardSpec& spec, int column, int row) {
  std::string text;
  for (int y = 0; y < spec.cells_per_square; ++y) {
    for (int x = 0; x < spec.cells_per_square; ++x) {
      const int at =
          (row * spec.cells_per_square + y) * cells.columns + column * spec.cells_per_square + x;
      text += cells.white[static_cast<std::size_t>(at)] ? '.' : '#';
    }
    text += '\n';
  }
  return text;
}

TEST(BoardCells, BeginWithABlackSquareAndTheFirstMarkerOfTheDictionary) {
  const BoardSpec spec;
  const BoardCells cells = board_cells(spec);
  ASSERT_EQ(cells.columns, 110);
  ASSERT_EQ(cells.rows, 90);
  ASSERT_EQ(cells.white.size(), 9900U);
  const std::string black = square_of(cells, spec, 0, 0);
  EXPECT_EQ(std::count(black.begin(), black.end(), '#'), 100);
  // Marker 0 of DICT_4X4_250 is 1011 0101 0011 0010 (OpenCV, predefined_dictionaries.hpp: 181, 50);
  // a one is white.
  EXPECT_EQ(square_of(cells, spec, 1, 0),
            "..........\n"
            "..........\n"
            "..######..\n"
            "..#.#..#..\n"
            "..##.#.#..\n"
            "..###..#..\n"
            "..###.##..\n"
            "..######..\n"
            "..........\n"
            "..........\n");
}

TEST(BoardSpec, RefusesABoardThatIsNone) {
  const auto refused = [](const auto& spoil, const char* says) {
    BoardSpec spec;
    spoil(spec);
    EXPECT_THAT([&] { spec.validate(); },
                testing::ThrowsMessage<std::invalid_argument>(testing::HasSubstr(says)));
    EXPECT_THROW(board_cells(spec), std::invalid_argument) << says;
  };
  refused([](BoardSpec& s) { s.rows = 8; }, "8 rows");
  refused([](BoardSpec& s) { s.columns = 2; }, "2 x 9");
  refused([](BoardSpec& s) { s.square_mm = 0.0; }, "0 mm");
  refused([](BoardSpec& s) { s.square_mm = -8.0; }, "-8 mm");
  refused([](BoardSpec& s) { s.cells_per_square = 6; }, "6 cells");
  refused([](BoardSpec& s) { s.cells_per_square = 9; }, "9 cells");
  refused([](BoardSpec& s) { s.first_marker = 202; }, "202 to 250");
  refused([](BoardSpec& s) { s.first_marker = -1; }, "-1");
  BoardSpec last;
  last.first_marker = 201;
  EXPECT_NO_THROW(last.validate());
}

}  // namespace
}  // namespace gonio::calibration::board
