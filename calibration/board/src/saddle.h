#pragma once

#include <Eigen/Core>
#include <opencv2/core.hpp>

namespace gonio::calibration::board {

/// What a window about a corner came to.
enum class SaddleOutcome {
  found,
  at_the_edge,  ///< the window leaves the picture
  unusable,     ///< too many of its pixels carry no value
  misfit        ///< it shows no such corner
};

struct Saddle {
  SaddleOutcome outcome = SaddleOutcome::misfit;
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();  ///< column and row; found only
};

/// Where two straight edges cross between two white and two black squares, by least squares of a
/// model of the picture: each edge a blurred step (the product of two error functions), white and
/// black each a plane. OpenCV's corner refinement takes every gradient for an edge: a white that
/// grows dimmer towards the rim draws its corners inwards by some 0.005 px, which makes focal
/// lengths 0.02 % too long; and it interpolates, which costs 0.03 px.
///
/// `image`  CV_32F, DN.
/// `used`   CV_8U of the same size: 0 where a pixel carries no value. Those are left out, and after
///          a first fit defects that no map knows; a corner that more than a tenth of its window
///          has none for is not found.
/// `start`  Within about a pixel of the corner; column, row.
/// `half`   The window reaches this far (px) to each side and holds nothing else than the squares.
/// Threads  Any.
Saddle fit_saddle(const cv::Mat& image, const cv::Mat& used, const Eigen::Vector2d& start,
                  int half);

}  // namespace gonio::calibration::board
