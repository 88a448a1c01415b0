#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "gonio/brdf/directions.h"

namespace gonio::design {

/// What a direction may be. All masks have one byte per basis cell, 0 = forbidden.
struct DirectionLimits {
  Angle theta_i_max = Angle::from_degrees(80.0);
  Angle theta_o_max = Angle::from_degrees(80.0);
  Angle theta_d_min = Angle::from_degrees(0.0);
};

/// True when the direction is above the horizon and obeys the limits.
bool within(const DirectionLimits& limits, const brdf::HalfDiff& direction);

/// Which basis cells a search may choose.
///
/// `allowed`  One byte per basis cell; empty allows all.
/// `accept`   Asked at most once per cell and search, from the calling thread, only about cells
///            that would be chosen next: for rigs whose inverse kinematics is numeric. Empty
///            accepts all. Must give the same answer every time it is asked.
/// `noise`    m sigma^2 of a sample there, nepers^2, not negative, on top of the search's own eta;
///            one per cell; empty: none.
/// `penalty`  What a sample there costs, as a share of the criterion: its natural logarithm rises
///            by this much, so at 0.01 a sample must lower the error by one per cent to be worth
///            it. For time: seconds times the share a second is worth. One per cell; empty: none.
struct Candidates {
  std::vector<std::uint8_t> allowed = {};
  std::function<bool(std::uint32_t basis_cell)> accept = {};
  std::vector<float> noise = {};
  std::vector<float> penalty = {};
};

/// Number of basis cells, and the angles of one (bin centre).
std::size_t basis_cell_count();
brdf::HalfDiff direction_of_basis_cell(std::uint32_t basis_cell);

/// The basis cell whose bin holds the direction; empty when that cell is below the horizon.
std::optional<std::uint32_t> basis_cell_of(const brdf::HalfDiff& direction);

/// Cells whose bin centres obey the limits.
std::vector<std::uint8_t> cells_within(const DirectionLimits& limits);

/// From one byte per lattice cell (as rig::ReachStatistics has) to one per basis cell.
/// Throws std::invalid_argument unless lattice::kCells long.
std::vector<std::uint8_t> basis_mask(std::span<const std::uint8_t> lattice_mask);

}  // namespace gonio::design
