#pragma once

#include <Eigen/Core>
#include <opencv2/core.hpp>
#include <optional>

namespace gonio::calibration::board {

/// Where two straight edges cross between two white and two black squares, by least squares of a
/// model of the picture: each edge a blurred step (the product of two error functions), white and
/// black each a plane. OpenCV's corner refinement takes every gradient for an edge: a white that
/// grows dimmer towards the rim draws its corners inwards by some 0.005 px, which makes focal
/// lengths 0.02 % too long; and it interpolates, which costs 0.03 px.
///
/// `image`  CV_32F, DN.
/// `start`  Within about a pixel of the corner; column, row.
/// `half`   The window reaches this far (px) to each side and holds nothing else than the squares.
/// Returns  Column and row; nothing where the window leaves the picture or shows no such corner.
/// Threads  Any.
std::optional<Eigen::Vector2d> fit_saddle(const cv::Mat& image, const Eigen::Vector2d& start,
                                          int half);

}  // namespace gonio::calibration::board
