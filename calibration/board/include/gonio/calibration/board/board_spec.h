#pragma once

#include <vector>

namespace gonio::calibration::board {

/// A ChArUco board: a chessboard with a marker in every white square.
///
/// Frame    Of its points: origin in the middle of the squares, x to the right and y up as it lies
///          face up with its first row on top, mm. Out of the face: x cross y.
/// Numbers  Corners between squares are numbered row by row from the top left; there are
///          (columns - 1) x (rows - 1) of them.
struct BoardSpec {
  int columns = 11;  ///< of squares
  /// Of squares; odd: the pattern of boards with an even number changed in OpenCV 4.6
  /// (opencv_contrib 3291).
  int rows = 9;
  double square_mm = 10.0;
  /// Of a square's edge: marker bits and their frame are whole cells of it. A marker of 4 x 4 bits
  /// has 6 cells; with 2 cells of white on either side a square has 10.
  int cells_per_square = 10;
  int first_marker = 0;  ///< of the dictionary DICT_4X4_250

  double cell_mm() const { return square_mm / cells_per_square; }
  int corner_columns() const { return columns - 1; }
  int corner_rows() const { return rows - 1; }

  /// Throws std::invalid_argument naming the field: too few squares, an even number of rows, sizes
  /// that are not positive, more markers than the dictionary has.
  void validate() const;
};

/// The board as cells of two inks.
struct BoardCells {
  int columns = 0;
  int rows = 0;
  std::vector<bool> white;  ///< row by row from the top left
};

/// What to print, or to draw in a simulated world. Throws as BoardSpec::validate().
BoardCells board_cells(const BoardSpec& spec);

}  // namespace gonio::calibration::board
