#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>
#include <vector>

#include "gonio/brdf/directions.h"

namespace gonio::brdf {

/// Which angle an index of the MERL lattice stands for. Three are in use; every file we write says
/// which (docs/formats.md).
///   left_edge   theta_h = 90 (i/90)^2, theta_d = i, phi_d = i degrees (Matusik's reference reader)
///   bin_centre  the same at i + 0.5 (default)
///   dtu         theta_h = 90 ((i + 0.105)/90)^2, theta_d = 90 i/89, phi_d = 180 i/179
///               (Nielsen et al. 2015, released code)
enum class IndexConvention { left_edge, bin_centre, dtu };

std::string_view to_string(IndexConvention convention);
/// Throws std::invalid_argument naming the three that exist.
IndexConvention index_convention_from_string(std::string_view name);

/// The 90 x 90 x 180 lattice of (theta_h, theta_d, phi_d) MERL is stored on; theta_h is square-root
/// spaced. Cells are numbered phi_d + 180 (theta_d + 90 theta_h), as in the file.
namespace lattice {

constexpr std::size_t kThetaH = 90;
constexpr std::size_t kThetaD = 90;
constexpr std::size_t kPhiD = 180;
constexpr std::size_t kCells = kThetaH * kThetaD * kPhiD;

struct Index {
  int theta_h;
  int theta_d;
  int phi_d;
  bool operator==(const Index&) const = default;
};

constexpr std::size_t cell_from_index(Index i) {
  return static_cast<std::size_t>(i.phi_d) +
         kPhiD *
             (static_cast<std::size_t>(i.theta_d) + kThetaD * static_cast<std::size_t>(i.theta_h));
}
constexpr Index index_from_cell(std::size_t cell) {
  return {static_cast<int>(cell / (kPhiD * kThetaD)), static_cast<int>(cell / kPhiD % kThetaD),
          static_cast<int>(cell % kPhiD)};
}

/// Angles of a cell; phi_h is 0.
HalfDiff angles_of(Index index, IndexConvention convention = IndexConvention::bin_centre);

/// The cell whose bin holds these angles (bins are the same in all conventions but dtu, whose
/// nearest index is taken). phi_d is folded by reciprocity into [0, 180); 180 is index 179 where
/// the caller says `phi_d` = 180 exactly; out-of-range angles are clamped.
Index nearest_index(const HalfDiff& angles,
                    IndexConvention convention = IndexConvention::bin_centre);

/// Cells whose representative angles lie above the horizon, ascending: 1,096,216 for bin centres.
/// Computed once per convention and shared.
const std::vector<std::uint32_t>& cells_above_horizon(
    IndexConvention convention = IndexConvention::bin_centre);

/// The up to eight cells around a direction and their trilinear weights, in the coordinates
/// (90 sqrt(theta_h/90 deg), theta_d, phi_d): phi_d wraps by reciprocity (period 180 deg),
/// theta_h and theta_d are clamped at the ends. Corners for which `usable` is zero are dropped and
/// the rest renormalised; `count` = 0 when no corner is usable.
struct Corners {
  std::array<std::uint32_t, 8> cells;
  std::array<double, 8> weights;
  int count = 0;
};
Corners trilinear_corners(const HalfDiff& angles, IndexConvention convention,
                          const std::vector<std::uint8_t>& usable);

/// One byte per cell of the lattice, 1 where cells_above_horizon() lists it.
const std::vector<std::uint8_t>& above_horizon_mask(
    IndexConvention convention = IndexConvention::bin_centre);

}  // namespace lattice
}  // namespace gonio::brdf
