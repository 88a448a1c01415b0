#include "highlight.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "gonio/calibration/result/step_refused.h"
#include "gonio/instrument/pixel_counts.h"
#include "good_neighbours.h"

namespace gonio::calibration::routine {
namespace {

constexpr double kEdgeOfSpot = 0.25;    // of its height
constexpr double kMinHeight_dn = 60.0;  // above what surrounds it
constexpr double kMaxBright = 0.2;      // of the picture: more is no mirror
constexpr int kMaxIterations = 20;
constexpr double kConverged_px = 1e-4;
constexpr double kWindowSigmas = 4.0;
// A lens spreads every point: the pixel beside the brightest of a spot holds most of its height.
constexpr double kLeastBeside = 1.0 / 3.0;
// Of saturation: beside a pixel that light has filled the others are nearly full.
constexpr double kBesideFull = 0.75;

/// A frame in which the mean of their neighbours stands for bad pixels, and for those that are
/// bright alone.
class MendedFrame {
 public:
  MendedFrame(const devices::Frame& frame, std::span<const std::uint8_t> bad_pixels, double around)
      : frame_(frame), map_{frame.width_px, frame.height_px, bad_pixels}, around_(around) {}

  bool is_spike(int row, int column) const {
    if (map_.is_bad(row, column)) return true;
    const double value = frame_.at(row, column);
    double beside = 0.0;
    each_good_neighbour(map_, row, column, [&](int r, int c) {
      beside = std::max(beside, static_cast<double>(frame_.at(r, c)));
    });
    const double full = frame_.saturation_level_dn;
    return beside - around_ < kLeastBeside * (value - around_) ||
           (value >= full && beside < kBesideFull * full);
  }

  double mended(int row, int column) const {
    return mean_of_neighbours(map_, row, column, [&](int r, int c) { return frame_.at(r, c); })
        .value_or(around_);
  }

  /// `above`  Only what is brighter is asked whether it is bright alone; below are its neighbours.
  double at(int row, int column, double above) const {
    const double value = frame_.at(row, column);
    if (map_.is_bad(row, column)) return mended(row, column);
    return value > above && is_spike(row, column) ? mended(row, column) : value;
  }

  /// Mean over 3 x 3.
  double smoothed(int row, int column, double above) const {
    double sum = 0.0;
    for (int r = -1; r <= 1; ++r) {
      for (int c = -1; c <= 1; ++c) sum += at(row + r, column + c, above);
    }
    return sum / 9.0;
  }

 private:
  const devices::Frame& frame_;
  PixelMap map_;
  double around_;
};

}  // namespace

std::optional<Highlight> find_highlight(const devices::Frame& frame,
                                        std::span<const std::uint8_t> bad_pixels,
                                        double black_level_dn, double expected_radius_px) {
  const instrument::PixelCounts counts(frame.pixels_dn);
  const double around = counts.nth_smallest(frame.pixels_dn.size() / 2);
  const MendedFrame mended(frame, bad_pixels, around);
  double height = 0.0;
  int top_row = 0;
  int top_column = 0;
  const int least = static_cast<int>(std::ceil(around + kMinHeight_dn));
  for (int row = 1; row + 1 < frame.height_px; ++row) {
    const std::uint16_t* const pixels =
        frame.pixels_dn.data() + static_cast<std::size_t>(row) * frame.width_px;
    for (int column = 1; column + 1 < frame.width_px; ++column) {
      if (pixels[column] < least || mended.is_spike(row, column)) continue;
      const double here = mended.smoothed(row, column, around + kMinHeight_dn) - around;
      if (here > height) {
        height = here;
        top_row = row;
        top_column = column;
      }
    }
  }
  if (height < kMinHeight_dn) return std::nullopt;
  const double edge = around + kEdgeOfSpot * height;
  const auto bright = static_cast<double>(counts.above(edge));
  const auto pixels = static_cast<double>(frame.pixels_dn.size());
  const double radius = std::max(4.0 * expected_radius_px, 4.0);
  const double spot = 3.2 * radius * radius;
  if (bright > std::max(kMaxBright * pixels, spot) || around - black_level_dn > height) {
    throw StepRefused(
        fmt::format("found {:.0f} % of the picture bright, expected the lamp's image alone: is the "
                    "mirror in the holder, and the room dark?",
                    100.0 * bright / pixels));
  }
  // A window that follows the centroid; what is below the edge does not pull.
  Highlight found{Eigen::Vector2d(top_column, top_row), 0.0, 0.0};
  for (int iteration = 0; iteration < kMaxIterations; ++iteration) {
    const int left = static_cast<int>(std::floor(found.pixel.x() - radius));
    const int right = static_cast<int>(std::ceil(found.pixel.x() + radius));
    const int top = static_cast<int>(std::floor(found.pixel.y() - radius));
    const int bottom = static_cast<int>(std::ceil(found.pixel.y() + radius));
    if (left < 0 || top < 0 || right >= frame.width_px || bottom >= frame.height_px) {
      return std::nullopt;
    }
    double weight = 0.0;
    double sum = 0.0;
    double second = 0.0;
    Eigen::Vector2d mean = Eigen::Vector2d::Zero();
    for (int row = top; row <= bottom; ++row) {
      for (int column = left; column <= right; ++column) {
        const Eigen::Vector2d here(column, row);
        const double distance = (here - found.pixel).norm();
        if (distance > radius) continue;
        const double value = mended.at(row, column, edge);
        sum += value - around;
        if (value <= edge) continue;
        if (value >= frame.saturation_level_dn) {
          throw StepRefused("found the lamp's image saturated, expected a shorter exposure");
        }
        weight += value - edge;
        mean += (value - edge) * here;
        second += (value - edge) * distance * distance;
      }
    }
    mean /= weight;
    const double step = (mean - found.pixel).norm();
    found = {mean, sum, std::sqrt(2.0 * second / weight)};
    if (step < kConverged_px) break;
  }
  return found;
}

double windowed_sum(const devices::Frame& frame, std::span<const std::uint8_t> bad_pixels,
                    double black_level_dn, const Eigen::Vector2d& centre, double sigma_px) {
  const PixelMap map{frame.width_px, frame.height_px, bad_pixels};
  const auto raw = [&](int row, int column) { return static_cast<double>(frame.at(row, column)); };
  const double reach = kWindowSigmas * sigma_px;
  double sum = 0.0;
  const int top = std::max(0, static_cast<int>(std::floor(centre.y() - reach)));
  const int bottom = std::min(frame.height_px - 1, static_cast<int>(std::ceil(centre.y() + reach)));
  const int left = std::max(0, static_cast<int>(std::floor(centre.x() - reach)));
  const int right = std::min(frame.width_px - 1, static_cast<int>(std::ceil(centre.x() + reach)));
  for (int row = top; row <= bottom; ++row) {
    for (int column = left; column <= right; ++column) {
      const double r2 = (Eigen::Vector2d(column, row) - centre).squaredNorm();
      const double value = map.is_bad(row, column)
                               ? mean_of_neighbours(map, row, column, raw).value_or(black_level_dn)
                               : raw(row, column);
      sum += (value - black_level_dn) * std::exp(-0.5 * r2 / (sigma_px * sigma_px));
    }
  }
  return sum;
}

}  // namespace gonio::calibration::routine
