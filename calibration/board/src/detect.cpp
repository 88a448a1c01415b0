#include "gonio/calibration/board/detect.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <opencv2/aruco/charuco.hpp>
#include <opencv2/imgproc.hpp>
#include <stdexcept>
#include <vector>

#include "dictionary.h"
#include "gonio/calibration/result/step_refused.h"
#include "gonio/instrument/pixel_counts.h"
#include "saddle.h"

namespace gonio::calibration::board {
namespace {

constexpr double kDarkest = 0.01;  // quantiles that become 0 and 255 in the copy for the markers
constexpr double kBrightest = 0.99;
constexpr double kMinContrast_dn = 40.0;
constexpr double kMaxSaturated = 0.02;  // of the pixels
constexpr int kGoodNeighbours = 5;      // of eight: a pixel alone, and no edge of an area
constexpr double kMinFound = 0.6;       // of the board's corners
constexpr int kMarkerImage_px = 900;    // wider pictures are halved for the markers
// cornerSubPix, from which fit_saddle() begins, interpolates linearly, which an edge one pixel wide
// is too sharp for.
constexpr double kSmooth_px = 1.0;
constexpr int kMostHalf_px = 12;  // of a window: beyond it the time grows, and the lens bends edges
constexpr int kRefineIterations = 60;
constexpr double kRefined_px = 1e-4;

struct Levels {
  double low;
  double high;
};

bool is_bad(const BoardImage& image, std::size_t pixel) {
  return !image.bad_pixels.empty() && image.bad_pixels[pixel] != 0;
}

/// CV_8U: 0 where a pixel carries no value.
cv::Mat usable_pixels(const BoardImage& image) {
  cv::Mat usable(image.height_px, image.width_px, CV_8U);
  for (std::size_t i = 0; i < image.pixels_dn.size(); ++i) {
    const bool full = static_cast<double>(image.pixels_dn[i]) >= image.saturation_dn;
    usable.data[i] = full || is_bad(image, i) ? 0 : 1;
  }
  return usable;
}

/// A copy in which the mean of its good neighbours stands for a pixel that has no value, for what
/// knows no mask: markers, and where fit_saddle() begins.
cv::Mat mended(const cv::Mat& frame, const cv::Mat& usable) {
  cv::Mat copy = frame.clone();
  for (int row = 1; row + 1 < frame.rows; ++row) {
    for (int column = 1; column + 1 < frame.cols; ++column) {
      if (usable.at<std::uint8_t>(row, column) != 0) continue;
      int sum = 0;
      int good = 0;
      for (int y = row - 1; y <= row + 1; ++y) {
        for (int x = column - 1; x <= column + 1; ++x) {
          if (usable.at<std::uint8_t>(y, x) == 0) continue;
          sum += frame.at<std::uint16_t>(y, x);
          ++good;
        }
      }
      if (good >= kGoodNeighbours) {
        copy.at<std::uint16_t>(row, column) = static_cast<std::uint16_t>(sum / good);
      }
    }
  }
  return copy;
}

Levels levels_of(const BoardImage& image) {
  std::vector<std::uint16_t> values;
  values.reserve(image.pixels_dn.size());
  for (std::size_t i = 0; i < image.pixels_dn.size(); ++i) {
    if (!is_bad(image, i)) values.push_back(image.pixels_dn[i]);
  }
  if (values.empty()) return {0.0, 0.0};
  const instrument::PixelCounts counts(values);
  const auto quantile = [&](double share) {
    return static_cast<double>(counts.nth_smallest(
        static_cast<std::size_t>(share * static_cast<double>(values.size() - 1))));
  };
  return {quantile(kDarkest), quantile(kBrightest)};
}

cv::Mat eight_bit(const cv::Mat& image, const Levels& levels) {
  cv::Mat copy;
  const double scale = 255.0 / (levels.high - levels.low);
  image.convertTo(copy, CV_8U, scale, -levels.low * scale);
  return copy;
}

/// Half the width of a window about a corner that reaches no marker: they begin a few cells from
/// the edges of their squares.
int window_half(const std::vector<cv::Point2f>& corners, const std::vector<int>& ids,
                const BoardSpec& spec) {
  float nearest = std::numeric_limits<float>::max();
  for (std::size_t i = 0; i < ids.size(); ++i) {
    for (std::size_t j = i + 1; j < ids.size(); ++j) {
      nearest = std::min(nearest, static_cast<float>(cv::norm(corners[i] - corners[j])));
    }
  }
  const int margin_cells = (spec.cells_per_square - kMarkerBits - 2) / 2;
  const double margin_px =
      static_cast<double>(nearest) * margin_cells / static_cast<double>(spec.cells_per_square);
  return std::max(2, static_cast<int>(std::floor(0.8 * margin_px)));
}

void require_picture(const BoardImage& image) {
  const auto pixels = static_cast<std::size_t>(std::max(image.width_px, 0)) *
                      static_cast<std::size_t>(std::max(image.height_px, 0));
  if (pixels == 0 || image.pixels_dn.size() != pixels) {
    throw std::invalid_argument(fmt::format("board: found {} pixels, expected {} x {}",
                                            image.pixels_dn.size(), image.width_px,
                                            image.height_px));
  }
  if (!image.bad_pixels.empty() && image.bad_pixels.size() != pixels) {
    throw std::invalid_argument(fmt::format("board: found a mask of {} pixels, expected {} x {}",
                                            image.bad_pixels.size(), image.width_px,
                                            image.height_px));
  }
  double saturated = 0.0;
  for (std::size_t i = 0; i < pixels; ++i) {
    const bool full = static_cast<double>(image.pixels_dn[i]) >= image.saturation_dn;
    if (full && !is_bad(image, i)) saturated += 1.0;
  }
  if (saturated > kMaxSaturated * static_cast<double>(pixels)) {
    throw StepRefused(fmt::format(
        "board: found {:.0f} % of the picture saturated, expected at most {:.0f} %: expose less",
        100.0 * saturated / static_cast<double>(pixels), 100.0 * kMaxSaturated));
  }
}

bool too_few(std::size_t corners, const BoardSpec& spec) {
  return static_cast<double>(corners) < kMinFound * spec.corner_columns() * spec.corner_rows();
}

/// What became of the corners between the markers that were found.
struct Dropped {
  int at_the_edge = 0;
  int unusable = 0;
  int misfit = 0;

  void count(SaddleOutcome outcome) {
    if (outcome == SaddleOutcome::at_the_edge) ++at_the_edge;
    if (outcome == SaddleOutcome::unusable) ++unusable;
    if (outcome == SaddleOutcome::misfit) ++misfit;
  }
};

void require_corners(const geometry::BoardView& view, std::size_t between_markers,
                     const Dropped& dropped, const BoardSpec& spec) {
  if (!too_few(view.corners.size(), spec)) return;
  throw StepRefused(fmt::format(
      "board: found {} of {} corners fit to use, expected at least {:.0f} %; of {} between markers "
      "{} lie at the picture's edge, {} among saturated or bad pixels and {} are no sharp corner: "
      "is the board in focus, evenly lit and not overexposed?",
      view.corners.size(), spec.corner_columns() * spec.corner_rows(), 100.0 * kMinFound,
      between_markers, dropped.at_the_edge, dropped.unusable, dropped.misfit));
}

}  // namespace

geometry::BoardView detect(const BoardImage& image, const BoardSpec& spec) {
  spec.validate();
  require_picture(image);
  const Levels levels = levels_of(image);
  if (levels.high - levels.low < kMinContrast_dn) {
    throw StepRefused(fmt::format(
        "board: found {:.0f} DN between dark and bright, expected {:.0f} or more: is the lamp on, "
        "and the board in the holder?",
        levels.high - levels.low, kMinContrast_dn));
  }

  cv::setNumThreads(1);  // the same corners on every machine
  const cv::Mat raw(image.height_px, image.width_px, CV_16U,
                    const_cast<std::uint16_t*>(image.pixels_dn.data()));
  const cv::Mat usable = usable_pixels(image);
  const cv::Mat frame = mended(raw, usable);
  cv::Mat small = eight_bit(frame, levels);
  int halved = 1;
  while (small.cols > kMarkerImage_px) {
    cv::resize(small, small, {}, 0.5, 0.5, cv::INTER_AREA);
    halved *= 2;
  }
  const cv::Ptr<cv::aruco::Dictionary> markers = dictionary();
  const int marker_cells = kMarkerBits + 2;
  cv::Ptr<cv::aruco::CharucoBoard> board =
      cv::aruco::CharucoBoard::create(spec.columns, spec.rows, static_cast<float>(spec.square_mm),
                                      static_cast<float>(spec.cell_mm() * marker_cells), markers);
  for (int& id : board->ids) id += spec.first_marker;
  std::vector<std::vector<cv::Point2f>> outlines;
  std::vector<int> ids;
  cv::aruco::detectMarkers(small, markers, outlines, ids);
  if (ids.empty()) {
    throw StepRefused(
        "board: found no marker, expected the calibration board: is it in the holder, face "
        "outwards?");
  }
  std::vector<cv::Point2f> corners;
  std::vector<int> corner_ids;
  cv::aruco::interpolateCornersCharuco(outlines, ids, small, board, corners, corner_ids);
  const int all = spec.corner_columns() * spec.corner_rows();
  if (too_few(corner_ids.size(), spec)) {
    throw StepRefused(fmt::format(
        "board: found {} of {} corners, expected at least {:.0f} %: is part of it hidden, or "
        "outside the picture?",
        corner_ids.size(), all, 100.0 * kMinFound));
  }
  for (cv::Point2f& corner : corners) {
    corner =
        (corner + cv::Point2f(0.5F, 0.5F)) * static_cast<float>(halved) - cv::Point2f(0.5F, 0.5F);
  }
  cv::Mat exact;
  cv::Mat smooth;
  frame.convertTo(exact, CV_32F);
  cv::GaussianBlur(exact, smooth, {}, kSmooth_px);
  const int half = window_half(corners, corner_ids, spec);
  cv::cornerSubPix(
      smooth, corners, {half, half}, {-1, -1},
      {cv::TermCriteria::COUNT + cv::TermCriteria::EPS, kRefineIterations, kRefined_px});

  geometry::BoardView view;
  Dropped dropped;
  for (std::size_t i = 0; i < corner_ids.size(); ++i) {
    const Saddle saddle =
        fit_saddle(exact, usable, {corners[i].x, corners[i].y}, std::min(half, kMostHalf_px));
    dropped.count(saddle.outcome);
    if (saddle.outcome != SaddleOutcome::found) continue;
    const int column = corner_ids[i] % spec.corner_columns();
    const int row = corner_ids[i] / spec.corner_columns();
    view.corners.push_back({corner_ids[i],
                            saddle.pixel,
                            {(column + 1 - 0.5 * spec.columns) * spec.square_mm,
                             (0.5 * spec.rows - row - 1) * spec.square_mm}});
  }
  require_corners(view, corner_ids.size(), dropped, spec);
  return view;
}

}  // namespace gonio::calibration::board
