#pragma once

#include <Eigen/Core>
#include <vector>

namespace gonio::calibration::geometry {

/// One corner of a flat calibration board, found in an image.
struct BoardCorner {
  int id = 0;                ///< which corner of the board; once per view
  Eigen::Vector2d pixel;     ///< (column, row), whole numbers at pixel centres
  Eigen::Vector2d point_mm;  ///< in the board's plane; the same in every view
};

/// A board as one image shows it.
///
/// Frame    Board: x, y in the plane as the corners' points say, z = x cross y: into the board
///          where x runs right and y down on its face (OpenCV), out of it where y runs up.
struct BoardView {
  std::vector<BoardCorner> corners;
};

}  // namespace gonio::calibration::geometry
