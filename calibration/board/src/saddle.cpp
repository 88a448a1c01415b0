#include "saddle.h"

#include <Eigen/Cholesky>
#include <Eigen/QR>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <optional>
#include <utility>
#include <vector>

namespace gonio::calibration::board {
namespace {

// Order of the unknowns: the corner, directions of the edges' normals, blur, planes of white and
// black (level at the window's middle, slopes).
constexpr Eigen::Index kCorner = 0;
constexpr Eigen::Index kNormals = 2;
constexpr Eigen::Index kBlur = 4;
constexpr Eigen::Index kWhite = 5;
constexpr Eigen::Index kBlack = 8;
constexpr Eigen::Index kUnknowns = 11;
using Unknowns = Eigen::Matrix<double, kUnknowns, 1>;
using Normal = Eigen::Matrix<double, kUnknowns, kUnknowns>;

constexpr double kFirstBlur_px = 0.8;
constexpr double kLeastBlur_px = 0.15;  // a step within a pixel: what a pixel's own width leaves
constexpr double kMostBlur_px = 4.0;
constexpr double kMostMoved_px = 1.5;
constexpr double kFound_px = 1e-5;
constexpr int kSteps = 40;
// Of half the contrast, rms over the window: markers, shadows and highlights fit worse.
constexpr double kMostMisfit = 0.15;
// Of the window: more leaves an edge to few pixels, and an overexposed square its dimmest ones
// only.
constexpr double kMostUnusable = 0.1;
// A pixel that is off by as much as this of half the contrast, and of the spread of the others (by
// their median; shot noise makes white wider than black), is a defect that no map knows.
constexpr double kDefect = 0.25;
constexpr double kDefectSpreads = 8.0;
constexpr double kNormalSpread = 1.4826;  // standard deviation over median deviation

/// A pixel of the window, from its middle.
struct Pixel {
  double x;
  double y;
  double value;
};

double plane(const Unknowns& u, Eigen::Index first, const Pixel& p) {
  return u[first] + u[first + 1] * p.x + u[first + 2] * p.y;
}

/// The model at a pixel, and its derivatives.
double model(const Unknowns& u, const Pixel& p, Unknowns& slope) {
  const double x = p.x - u[kCorner];
  const double y = p.y - u[kCorner + 1];
  const double blur = u[kBlur];
  std::array<double, 2> step{};
  std::array<double, 2> rise{};
  std::array<double, 2> distance{};
  std::array<double, 2> along{};
  std::array<Eigen::Vector2d, 2> normal;
  for (std::size_t i = 0; i < 2; ++i) {
    const double angle = u[kNormals + static_cast<Eigen::Index>(i)];
    normal[i] = {std::cos(angle), std::sin(angle)};
    distance[i] = normal[i].x() * x + normal[i].y() * y;
    along[i] = -normal[i].y() * x + normal[i].x() * y;
    const double z = distance[i] / blur;
    step[i] = std::erf(z * std::numbers::sqrt2 / 2.0);
    rise[i] = std::numbers::sqrt2 * std::numbers::inv_sqrtpi / blur * std::exp(-0.5 * z * z);
  }
  const double white = plane(u, kWhite, p);
  const double black = plane(u, kBlack, p);
  const double sides = step[0] * step[1];  // 1 in the white squares, -1 in the black ones
  const double contrast = 0.5 * (white - black);
  const std::array<double, 2> slopes{contrast * rise[0] * step[1], contrast * rise[1] * step[0]};
  slope[kCorner] = -slopes[0] * normal[0].x() - slopes[1] * normal[1].x();
  slope[kCorner + 1] = -slopes[0] * normal[0].y() - slopes[1] * normal[1].y();
  slope[kNormals] = slopes[0] * along[0];
  slope[kNormals + 1] = slopes[1] * along[1];
  slope[kBlur] = -(slopes[0] * distance[0] + slopes[1] * distance[1]) / blur;
  const double white_share = 0.5 * (1.0 + sides);
  const double black_share = 0.5 * (1.0 - sides);
  slope.segment<3>(kWhite) << white_share, white_share * p.x, white_share * p.y;
  slope.segment<3>(kBlack) << black_share, black_share * p.x, black_share * p.y;
  return white_share * white + black_share * black;
}

using Window = std::vector<Pixel>;

double misfit(const Window& window, const Unknowns& u) {
  Unknowns unused;
  double squares = 0.0;
  for (const Pixel& p : window) squares += std::pow(p.value - model(u, p, unused), 2);
  return squares;
}

/// Directions of the edges from the saddle's second derivatives (level lines through its middle),
/// white and black from the levels on both sides.
std::optional<Unknowns> first_guess(const Window& window, const Eigen::Vector2d& corner) {
  Eigen::MatrixXd terms(static_cast<Eigen::Index>(window.size()), 6);
  Eigen::VectorXd values(terms.rows());
  for (Eigen::Index k = 0; k < terms.rows(); ++k) {
    const Pixel& p = window[static_cast<std::size_t>(k)];
    const double x = p.x - corner.x();
    const double y = p.y - corner.y();
    terms.row(k) << 1.0, x, y, x * x, x * y, y * y;
    values[k] = p.value;
  }
  const Eigen::VectorXd quadric = terms.colPivHouseholderQr().solve(values);
  // a x^2 + b xy + c y^2 = |.| (n1 . r)(n2 . r): zero along both edges.
  const double a = quadric[3], b = quadric[4], c = quadric[5];
  const double discriminant = b * b - 4.0 * a * c;
  if (!(discriminant > 0.0)) return std::nullopt;
  // In double angle: (a + c)/2 + (a - c)/2 cos 2t + b/2 sin 2t = 0.
  const double phase = std::atan2(b, a - c);
  const double half_opening = std::acos(-(a + c) / std::hypot(b, a - c));
  const std::array<double, 2> edges{0.5 * (phase + half_opening), 0.5 * (phase - half_opening)};
  Unknowns u = Unknowns::Zero();
  u.segment<2>(kCorner) = corner;
  u[kNormals] = edges[0] + 0.5 * std::numbers::pi;
  u[kNormals + 1] = edges[1] + 0.5 * std::numbers::pi;
  u[kBlur] = kFirstBlur_px;
  std::array<double, 2> sums{};
  std::array<int, 2> counts{};
  for (const Pixel& p : window) {
    double side = 1.0;
    for (Eigen::Index i = 0; i < 2; ++i) {
      side *= std::cos(u[kNormals + i]) * (p.x - corner.x()) +
              std::sin(u[kNormals + i]) * (p.y - corner.y());
    }
    const std::size_t which = side > 0.0 ? 0 : 1;
    sums[which] += p.value;
    ++counts[which];
  }
  if (counts[0] == 0 || counts[1] == 0) return std::nullopt;
  u[kWhite] = sums[0] / counts[0];
  u[kBlack] = sums[1] / counts[1];
  return u;
}

/// The model's unknowns from a first guess on, by Levenberg and Marquardt; nothing where they do
/// not settle near `corner`.
std::optional<Unknowns> settled(const Window& window, const Eigen::Vector2d& corner, Unknowns u) {
  double squares = misfit(window, u);
  double damping = 1e-3;
  for (int k = 0; k < kSteps; ++k) {
    Normal normal = Normal::Zero();
    Unknowns gradient = Unknowns::Zero();
    Unknowns slope;
    for (const Pixel& p : window) {
      const double residual = p.value - model(u, p, slope);
      normal.selfadjointView<Eigen::Lower>().rankUpdate(slope);
      gradient += residual * slope;
    }
    normal.diagonal() *= 1.0 + damping;
    const Unknowns change = normal.selfadjointView<Eigen::Lower>().ldlt().solve(gradient);
    const Unknowns next = u + change;
    const bool sensible = next.allFinite() && next[kBlur] > kLeastBlur_px &&
                          next[kBlur] < kMostBlur_px &&
                          (next.segment<2>(kCorner) - corner).norm() < kMostMoved_px;
    const double then = sensible ? misfit(window, next) : squares;
    if (!sensible || then > squares) {
      damping *= 10.0;
      if (damping > 1e9) return std::nullopt;
      continue;
    }
    u = next;
    squares = then;
    damping = std::max(0.1 * damping, 1e-9);
    if (change.segment<2>(kCorner).norm() < kFound_px) return u;
  }
  return std::nullopt;
}

double contrast_of(const Unknowns& u) { return 0.5 * std::abs(u[kWhite] - u[kBlack]); }

/// The window without pixels that are far from the model where their neighbours are near.
Window without_defects(const Window& window, const Unknowns& u) {
  Unknowns unused;
  std::vector<double> far;
  for (const Pixel& p : window) far.push_back(std::abs(p.value - model(u, p, unused)));
  std::vector<double> sorted = far;
  const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2);
  std::nth_element(sorted.begin(), middle, sorted.end());
  const double limit = std::max(kDefect * contrast_of(u), kDefectSpreads * kNormalSpread * *middle);
  Window kept;
  for (std::size_t i = 0; i < window.size(); ++i) {
    if (far[i] <= limit) kept.push_back(window[i]);
  }
  return kept;
}

}  // namespace

Saddle fit_saddle(const cv::Mat& image, const cv::Mat& used, const Eigen::Vector2d& start,
                  int half) {
  const int column = static_cast<int>(std::lround(start.x()));
  const int row = static_cast<int>(std::lround(start.y()));
  if (column < half || row < half || column + half >= image.cols || row + half >= image.rows) {
    return {SaddleOutcome::at_the_edge};
  }
  Window window;
  for (int y = -half; y <= half; ++y) {
    for (int x = -half; x <= half; ++x) {
      if (used.at<std::uint8_t>(row + y, column + x) == 0) continue;
      window.push_back({static_cast<double>(x), static_cast<double>(y),
                        static_cast<double>(image.at<float>(row + y, column + x))});
    }
  }
  const double all = std::pow(2.0 * half + 1.0, 2);
  if (static_cast<double>(window.size()) < (1.0 - kMostUnusable) * all) {
    return {SaddleOutcome::unusable};
  }
  const Eigen::Vector2d corner = start - Eigen::Vector2d(column, row);
  const auto guess = first_guess(window, corner);
  if (!guess) return {SaddleOutcome::misfit};
  auto found = settled(window, corner, *guess);
  if (!found) return {SaddleOutcome::misfit};
  if (Window kept = without_defects(window, *found); kept.size() < window.size()) {
    if (static_cast<double>(kept.size()) < (1.0 - kMostUnusable) * all) {
      return {SaddleOutcome::misfit};
    }
    window = std::move(kept);
    found = settled(window, corner, *found);
    if (!found) return {SaddleOutcome::misfit};
  }
  const double rms = std::sqrt(misfit(window, *found) / static_cast<double>(window.size()));
  if (!(rms < kMostMisfit * contrast_of(*found))) return {SaddleOutcome::misfit};
  return {SaddleOutcome::found, found->segment<2>(kCorner) + Eigen::Vector2d(column, row)};
}

}  // namespace gonio::calibration::board
