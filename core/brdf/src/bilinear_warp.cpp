#include "bilinear_warp.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>
#include <utility>

namespace gonio::brdf {
namespace {

double mix(double a, double b, double t) { return a + t * (b - a); }

/// Integral of a linear function from 0 to `t` of a step of length 1.
double linear_integral(double first, double second, double t) {
  return t * (first + 0.5 * t * (second - first));
}

/// The t in [0, 1] at which linear_integral() reaches `area`.
double solve_linear_integral(double first, double second, double area) {
  const double slope = second - first;
  const double root = std::sqrt(std::fmax(first * first + 2.0 * slope * area, 0.0));
  // The form that does not subtract nearly equal numbers.
  const double sum = first + root;
  return sum > 0.0 ? std::fmin(std::fmax(2.0 * area / sum, 0.0), 1.0) : 0.0;
}

}  // namespace

AxisPlace AxisPlace::on(double position, std::size_t count) {
  const double last = static_cast<double>(count - 1);
  const double at = std::fmin(std::fmax(position * last, 0.0), last);
  const auto node = std::min(static_cast<std::size_t>(at), count - 2);
  return {node, at - static_cast<double>(node)};
}

double bilinear(std::span<const float> grid, std::size_t width, AxisPlace x, AxisPlace y) {
  const float* const lower = grid.data() + y.node * width + x.node;
  const float* const upper = lower + width;
  return mix(mix(lower[0], lower[1], x.fraction), mix(upper[0], upper[1], x.fraction), y.fraction);
}

BilinearWarp::BilinearWarp(std::vector<float> densities, std::size_t slices, std::size_t height,
                           std::size_t width)
    : slices_(slices),
      height_(height),
      width_(width),
      density_(std::move(densities)),
      along_x_(density_.size(), 0.0f),
      along_y_(slices * height, 0.0) {
  if (slices < 1 || height < 2 || width < 2 || density_.size() != slices * height * width) {
    throw std::invalid_argument("a warp of " + std::to_string(slices) + " x " +
                                std::to_string(height) + " x " + std::to_string(width) +
                                " nodes, expected at least 1 x 2 x 2");
  }
  const double step_x = 1.0 / static_cast<double>(width - 1);
  const double step_y = 1.0 / static_cast<double>(height - 1);
  for (std::size_t slice = 0; slice < slices; ++slice) {
    float* const values = density_.data() + slice * height * width;
    std::vector<double> totals(height, 0.0);
    double whole = 0.0;
    for (std::size_t row = 0; row < height; ++row) {
      for (std::size_t i = 0; i < width; ++i) {
        if (!(values[row * width + i] >= 0.0f)) {
          throw std::invalid_argument("slice " + std::to_string(slice) +
                                      " holds a negative density");
        }
        if (i == 0) continue;
        totals[row] += 0.5 * step_x *
                       (static_cast<double>(values[row * width + i - 1]) +
                        static_cast<double>(values[row * width + i]));
      }
      if (row > 0) whole += 0.5 * step_y * (totals[row - 1] + totals[row]);
    }
    if (!(whole > 0.0)) {
      throw std::invalid_argument("slice " + std::to_string(slice) + " is zero everywhere");
    }
    double up = 0.0;
    double previous = 0.0;
    for (std::size_t row = 0; row < height; ++row) {
      double sum = 0.0;
      for (std::size_t i = 0; i < width; ++i) {
        float& value = values[row * width + i];
        value = static_cast<float>(static_cast<double>(value) / whole);
        // A hostile file can hold numbers whose quotient is beyond single precision.
        value = std::min(value, std::numeric_limits<float>::max());
        if (i > 0) {
          sum += 0.5 * step_x *
                 (static_cast<double>(values[row * width + i - 1]) + static_cast<double>(value));
        }
        along_x_[(slice * height + row) * width + i] = static_cast<float>(sum);
      }
      if (row > 0) up += 0.5 * step_y * (previous + sum);
      previous = sum;
      along_y_[slice * height + row] = up;
    }
  }
}

BilinearWarp::Point BilinearWarp::to_uniform(Point at, std::size_t slice, double fraction) const {
  const AxisPlace x = AxisPlace::on(at.x, width_);
  const AxisPlace y = AxisPlace::on(at.y, height_);
  const double step_x = 1.0 / static_cast<double>(width_ - 1);
  const double step_y = 1.0 / static_cast<double>(height_ - 1);
  const std::size_t next = std::min(slice + 1, slices_ - 1);

  const auto mixed = [&](const std::vector<float>& table, std::size_t row, std::size_t node) {
    const std::size_t inside = row * width_ + node;
    return mix(table[slice * height_ * width_ + inside], table[next * height_ * width_ + inside],
               fraction);
  };
  // Up to `x` and over the whole of the two rows around `y`.
  double part[2];
  double total[2];
  for (std::size_t k = 0; k < 2; ++k) {
    const std::size_t row = y.node + k;
    part[k] = mixed(along_x_, row, x.node) +
              step_x * linear_integral(mixed(density_, row, x.node),
                                       mixed(density_, row, x.node + 1), x.fraction);
    total[k] = mixed(along_x_, row, width_ - 1);
  }
  const auto up = [&](std::size_t row) {
    return mix(along_y_[slice * height_ + row], along_y_[next * height_ + row], fraction);
  };
  const double row_total = mix(total[0], total[1], y.fraction);
  // A row without any density is passed over by the map; any point of it will do.
  const double u = row_total > 0.0 ? mix(part[0], part[1], y.fraction) / row_total : 0.0;
  const double v =
      (up(y.node) + step_y * linear_integral(total[0], total[1], y.fraction)) / up(height_ - 1);
  return {u, v};
}

BilinearWarp::Point BilinearWarp::from_uniform(Point uniform, std::size_t slice) const {
  const double step_x = 1.0 / static_cast<double>(width_ - 1);
  const double step_y = 1.0 / static_cast<double>(height_ - 1);
  const double* const up = along_y_.data() + slice * height_;
  const float* const sums = along_x_.data() + slice * height_ * width_;
  const float* const values = density_.data() + slice * height_ * width_;
  const double area = std::fmin(std::fmax(uniform.y, 0.0), 1.0) * up[height_ - 1];
  const auto row = static_cast<std::size_t>(
      std::clamp<std::ptrdiff_t>(std::upper_bound(up, up + height_, area) - up - 1, 0,
                                 static_cast<std::ptrdiff_t>(height_ - 2)));
  const double total[2] = {sums[(row + 1) * width_ - 1], sums[(row + 2) * width_ - 1]};
  const double t = solve_linear_integral(total[0], total[1], (area - up[row]) / step_y);

  const auto mixed = [&](const float* table, std::size_t i) {
    return mix(table[row * width_ + i], table[(row + 1) * width_ + i], t);
  };
  const double part = std::fmin(std::fmax(uniform.x, 0.0), 1.0) * mixed(sums, width_ - 1);
  std::size_t low = 0;
  std::size_t high = width_ - 1;
  while (high - low > 1) {
    const std::size_t middle = (low + high) / 2;
    (mixed(sums, middle) <= part ? low : high) = middle;
  }
  const double s = solve_linear_integral(mixed(values, low), mixed(values, low + 1),
                                         (part - mixed(sums, low)) / step_x);
  return {(static_cast<double>(low) + s) * step_x, (static_cast<double>(row) + t) * step_y};
}

}  // namespace gonio::brdf
