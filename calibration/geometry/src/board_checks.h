#pragma once

#include <span>
#include <string>

#include "gonio/calibration/geometry/board_view.h"

namespace gonio::calibration::geometry {

/// Throws StepRefused, its message beginning with `step`, for fewer than `min_corners` corners in a
/// view, corners that are no numbers or lie outside the image, twice the same id, an id with two
/// places on the board.
void check_views(const std::string& step, std::span<const BoardView> views, std::size_t min_corners,
                 int width_px, int height_px);

/// Root of the mean squared length of the pixel residuals (x, y, x, y, ...).
double rms_of_pixels(const Eigen::VectorXd& residual);

}  // namespace gonio::calibration::geometry
