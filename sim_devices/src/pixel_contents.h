#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "lens.h"
#include "target_view.h"

namespace gonio::sim {

/// How finely a picture is looked at.
struct Sampling {
  /// A pixel is looked at and blurred as parts x parts places, 1 or 2.
  std::size_t parts = 1;
  /// A place in which something else begins is the mean of some rays, which lie on a Fibonacci
  /// lattice (Sloan, Joe, Lattice Methods for Multiple Integration, 1994): no two share a column or
  /// a row, so that 34 of them place an edge along either to 1/34 px; a square grid of as many, to
  /// 1/6 px. 1: edges are not looked for.
  int rays = 1;
  int step = 1;
};

/// What lies in the pixels of one pose, before the lens blurs it and whatever band is looked at.
///
/// Most pixels show one surface that is the same in all directions: these are its number and the
/// irradiance. The others are listed with the radiance of their parts.
class PixelContents {
 public:
  static constexpr std::uint16_t kListed = 0xFFFF;

  /// The listed pixels of a row, from left to right.
  struct Row {
    std::vector<std::uint32_t> columns;
    /// parts^2 for each, row by row: the bands, W m^-2 sr^-1 per 1 W/sr.
    std::vector<std::array<float, 3>> radiances;
  };

  /// Looks anew, into memory that is there.
  void look(const TargetView& view, const Lens& lens, const Sampling& sampling);

  std::size_t width() const { return width_; }
  std::size_t height() const { return rows_.size(); }
  std::size_t parts() const { return sampling_.parts; }
  /// Surfaces or kListed, of a row's pixels.
  const std::uint16_t* surfaces(std::size_t row) const { return surfaces_.data() + row * width_; }
  const float* irradiances(std::size_t row) const { return irradiances_.data() + row * width_; }
  /// The irradiance of a pixel's middle and by how much it is more a pixel to the right and down.
  struct Light {
    float middle;
    float to_right;
    float down;
  };
  Light light(std::size_t row, std::size_t column) const {
    const std::size_t pixel = row * width_ + column;
    const std::size_t beside = column + 1 < width_ ? pixel : pixel - 1;
    const std::size_t above = row + 1 < rows_.size() ? pixel : pixel - width_;
    const float* const e = irradiances_.data();
    return {e[pixel], e[beside + 1] - e[beside], e[above + width_] - e[above]};
  }
  const Row& listed(std::size_t row) const { return rows_[row]; }
  /// BRDF by surface, 1/sr; zero of those that are always listed.
  const std::vector<std::array<float, 3>>& per_sr() const { return per_sr_; }

 private:
  class Looker;

  Sampling sampling_;
  std::size_t width_ = 0;
  std::vector<std::uint16_t> surfaces_;
  std::vector<float> irradiances_;
  std::vector<std::array<float, 3>> per_sr_;
  std::vector<Row> rows_;
  std::vector<std::uint16_t> kinds_;  ///< surfaces and whether they shine
};

}  // namespace gonio::sim
