#include "gonio/render/image.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

namespace gonio::render {
namespace {

constexpr int kLargest = 16384;

std::size_t checked_area(int width, int height) {
  if (width < 1 || height < 1 || width > kLargest || height > kLargest) {
    throw std::invalid_argument("image of " + std::to_string(width) + " x " +
                                std::to_string(height) + " pixels, each must be in 1.." +
                                std::to_string(kLargest));
  }
  return static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
}

std::uint8_t to_byte(double value) {
  return static_cast<std::uint8_t>(std::clamp(std::lround(value), 0L, 255L));
}

}  // namespace

Image::Image(int width, int height, Rgba8 fill)
    : width_(width), height_(height), pixels_(checked_area(width, height), fill) {}

void Image::draw(const Image& other, int x, int y) {
  const int from_row = std::max(0, -y);
  const int to_row = std::min(other.height(), height_ - y);
  const int from_column = std::max(0, -x);
  const int to_column = std::min(other.width(), width_ - x);
  for (int row = from_row; row < to_row; ++row) {
    for (int column = from_column; column < to_column; ++column) {
      Rgba8& pixel = at(x + column, y + row);
      pixel = blend(pixel, other.at(column, row));
    }
  }
}

Rgba8 blend(Rgba8 under, Rgba8 over, double opacity) {
  const double top = over.a / 255.0 * opacity;
  const double rest = under.a / 255.0 * (1.0 - top);
  const double alpha = top + rest;
  if (alpha <= 0.0) return {};
  const auto mix = [&](std::uint8_t low, std::uint8_t high) {
    return to_byte((high * top + low * rest) / alpha);
  };
  return {mix(under.r, over.r), mix(under.g, over.g), mix(under.b, over.b), to_byte(alpha * 255.0)};
}

}  // namespace gonio::render
