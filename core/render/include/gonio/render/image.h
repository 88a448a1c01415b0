#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace gonio::render {

/// One pixel as files and screens hold it: sRGB-encoded, alpha straight (not premultiplied).
struct Rgba8 {
  std::uint8_t r = 0;
  std::uint8_t g = 0;
  std::uint8_t b = 0;
  std::uint8_t a = 0;
  bool operator==(const Rgba8&) const = default;
};

/// A picture: row-major from the top left, transparent black when made.
class Image {
 public:
  /// Throws std::invalid_argument unless both are in [1, 16384].
  Image(int width, int height, Rgba8 fill = {});

  int width() const { return width_; }
  int height() const { return height_; }

  Rgba8& at(int x, int y) { return pixels_[index(x, y)]; }
  const Rgba8& at(int x, int y) const { return pixels_[index(x, y)]; }
  const std::vector<Rgba8>& pixels() const { return pixels_; }

  /// Lays `other` over this one with its top left at (x, y), blending by its alpha; what sticks out
  /// is cut off.
  void draw(const Image& other, int x, int y);

  bool operator==(const Image&) const = default;

 private:
  std::size_t index(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) +
           static_cast<std::size_t>(x);
  }

  int width_;
  int height_;
  std::vector<Rgba8> pixels_;
};

/// `over` laid on an opaque or transparent `under` with an extra opacity in [0, 1].
Rgba8 blend(Rgba8 under, Rgba8 over, double opacity = 1.0);

}  // namespace gonio::render
