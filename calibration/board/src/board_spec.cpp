#include "gonio/calibration/board/board_spec.h"

#include <fmt/format.h>

#include <opencv2/aruco/dictionary.hpp>
#include <stdexcept>

#include "dictionary.h"

namespace gonio::calibration::board {
namespace {

constexpr int kMarkerCells = kMarkerBits + 2;  // with its black frame

void require_board(bool ok, const std::string& what) {
  if (!ok) throw std::invalid_argument("calibration board: " + what);
}

/// Of the squares row by row from the top left, beginning with a black one.
bool is_black(int column, int row) { return column % 2 == row % 2; }

}  // namespace

void BoardSpec::validate() const {
  require_board(columns >= 3 && rows >= 3 && columns <= 99 && rows <= 99,
                fmt::format("found {} x {} squares, expected 3 to 99 each way", columns, rows));
  require_board(rows % 2 == 1, fmt::format("found {} rows, expected an odd number", rows));
  require_board(square_mm > 0.0 && square_mm < 1e4,
                fmt::format("found squares of {:g} mm, expected more than 0", square_mm));
  require_board(cells_per_square >= kMarkerCells + 2 && cells_per_square <= 100 &&
                    (cells_per_square - kMarkerCells) % 2 == 0,
                fmt::format("found {} cells along a square, expected an even number, {} or more",
                            cells_per_square, kMarkerCells + 2));
  const int markers = columns * rows / 2;
  require_board(first_marker >= 0 && first_marker + markers <= kDictionarySize,
                fmt::format("found markers {} to {}, expected 0 to {}", first_marker,
                            first_marker + markers - 1, kDictionarySize - 1));
}

BoardCells board_cells(const BoardSpec& spec) {
  spec.validate();
  const cv::Ptr<cv::aruco::Dictionary> markers = dictionary();
  const int side = spec.cells_per_square;
  BoardCells cells{spec.columns * side, spec.rows * side, {}};
  cells.white.assign(static_cast<std::size_t>(cells.columns) * static_cast<std::size_t>(cells.rows),
                     true);
  const auto paint_black = [&](int column, int row) {
    cells.white[static_cast<std::size_t>(row) * static_cast<std::size_t>(cells.columns) +
                static_cast<std::size_t>(column)] = false;
  };
  const int margin = (side - kMarkerCells) / 2;
  int marker = spec.first_marker;
  for (int row = 0; row < spec.rows; ++row) {
    for (int column = 0; column < spec.columns; ++column) {
      if (is_black(column, row)) {
        for (int y = 0; y < side; ++y) {
          for (int x = 0; x < side; ++x) paint_black(column * side + x, row * side + y);
        }
        continue;
      }
      const cv::Mat bits = cv::aruco::Dictionary::getBitsFromByteList(
          markers->bytesList.rowRange(marker, marker + 1), kMarkerBits);
      ++marker;
      for (int y = 0; y < kMarkerCells; ++y) {
        for (int x = 0; x < kMarkerCells; ++x) {
          const bool frame = x == 0 || y == 0 || x == kMarkerCells - 1 || y == kMarkerCells - 1;
          if (frame || bits.at<unsigned char>(y - 1, x - 1) == 0) {
            paint_black(column * side + margin + x, row * side + margin + y);
          }
        }
      }
    }
  }
  return cells;
}

}  // namespace gonio::calibration::board
