#include "gonio/render/difference.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <string>

#include "develop.h"
#include "gonio/parallel/parallel.h"
#include "gonio/render/colour.h"
#include "percentile.h"

namespace gonio::render {
namespace {

std::uint8_t encoded(double linear) {
  return static_cast<std::uint8_t>(std::lround(255.0 * srgb_encode(std::clamp(linear, 0.0, 1.0))));
}

/// Hue, chroma and lightness along the scale, as far out as sRGB goes.
struct Stop {
  double lightness;
  double chroma;
  double hue_deg;
};
constexpr std::array<Stop, 6> kStops = {{{13.0, 26.0, 288.0},
                                         {28.0, 48.0, 308.0},
                                         {45.0, 62.0, 360.0},
                                         {62.0, 68.0, 408.0},
                                         {78.0, 70.0, 435.0},
                                         {96.0, 32.0, 462.0}}};

}  // namespace

Rgba8 heat_colour(double t) {
  const double at = std::clamp(t, 0.0, 1.0) * static_cast<double>(kStops.size() - 1);
  const std::size_t low = std::min(static_cast<std::size_t>(at), kStops.size() - 2);
  const double share = at - static_cast<double>(low);
  const auto mix = [&](double Stop::*what) {
    return kStops[low].*what + share * (kStops[low + 1].*what - kStops[low].*what);
  };
  const double hue = mix(&Stop::hue_deg) * std::numbers::pi / 180.0;
  const double chroma = mix(&Stop::chroma);
  const Eigen::Array3d rgb =
      linear_srgb_from_lab({mix(&Stop::lightness), chroma * std::cos(hue), chroma * std::sin(hue)});
  return {encoded(rgb[0]), encoded(rgb[1]), encoded(rgb[2]), 255};
}

Image heat_bar(int width, int height) {
  Image bar(width, height);
  for (int x = 0; x < width; ++x) {
    const Rgba8 colour = heat_colour((x + 0.5) / width);
    for (int y = 0; y < height; ++y) bar.at(x, y) = colour;
  }
  return bar;
}

DifferencePicture difference_picture(const SpherePicture& reference, const SpherePicture& other,
                                     double exposure, double full_scale) {
  if (reference.size != other.size) {
    throw std::invalid_argument("difference of pictures of " + std::to_string(reference.size) +
                                " and " + std::to_string(other.size) + " pixels");
  }
  if (!(full_scale > 0.0)) throw std::invalid_argument("difference scale must be positive");

  const std::size_t area = reference.radiance.size();
  std::vector<double> delta_e(area, 0.0);
  constexpr std::size_t kBlock = 4096;
  parallel::for_each_block(0, area, kBlock, [&](std::size_t from, std::size_t to) {
    for (std::size_t i = from; i < to; ++i) {
      if (reference.coverage[i] <= 0.0F) continue;
      delta_e[i] = delta_e_2000(lab_from_linear_srgb(shown_linear(reference.radiance[i], exposure)),
                                lab_from_linear_srgb(shown_linear(other.radiance[i], exposure)));
    }
  });

  DifferencePicture picture{Image(reference.size, reference.size), 0.0, 0.0};
  std::vector<double> whole;
  for (int y = 0; y < reference.size; ++y) {
    for (int x = 0; x < reference.size; ++x) {
      const std::size_t at =
          static_cast<std::size_t>(y) * static_cast<std::size_t>(reference.size) +
          static_cast<std::size_t>(x);
      if (reference.coverage[at] <= 0.0F) continue;
      if (reference.coverage[at] >= 1.0F) whole.push_back(delta_e[at]);
      Rgba8 colour = heat_colour(delta_e[at] / full_scale);
      colour.a = static_cast<std::uint8_t>(std::lround(255.0F * reference.coverage[at]));
      picture.image.at(x, y) = colour;
    }
  }
  for (const double value : whole) picture.mean_delta_e += value;
  picture.mean_delta_e /= static_cast<double>(std::max<std::size_t>(1, whole.size()));
  picture.p95_delta_e = percentile(std::move(whole), 0.95);
  return picture;
}

}  // namespace gonio::render
