#include <cstdio>
#include <limits>
#include <span>
#include <stdexcept>
#include <string>

#include "gonio/brdf/brdf_table.h"
#include "gonio/errors/errors.h"
#include "gonio/parallel/parallel.h"
#include "large_pages.h"
#include "sin_cos.h"

namespace gonio::brdf {
namespace {

/// Small enough to share out evenly, large enough that handing out costs nothing.
constexpr std::size_t kTabulatedCells = 8192;

[[noreturn]] void throw_not_finite(std::uint32_t cell, IndexConvention convention) {
  const HalfDiff at = lattice::angles_of(lattice::index_from_cell(cell), convention);
  char place[120];
  std::snprintf(place, sizeof place, "theta_h %.4g, theta_d %.4g, phi_d %.4g deg",
                at.theta_h.degrees(), at.theta_d.degrees(), at.phi_d.degrees());
  throw NumericalError("BRDF model is not finite at " + std::string(place));
}

/// Calls take(position in `cells`, cell, value) for every cell, in parallel.
template <typename Take>
void evaluate_each(const BrdfModel& model, std::span<const std::uint32_t> cells,
                   IndexConvention convention, const Take& take) {
  const lattice::LatticeSinCos axes(convention);
  parallel::for_each_block(
      0, cells.size(), kTabulatedCells, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
          const std::uint32_t cell = cells[i];
          if (cell >= lattice::kCells) {
            throw std::invalid_argument("cell " + std::to_string(cell) + " is not on the lattice");
          }
          const lattice::Index at = lattice::index_from_cell(cell);
          const Rgb value =
              model.evaluate(shading_geometry(axes.theta_h[static_cast<std::size_t>(at.theta_h)],
                                              axes.theta_d[static_cast<std::size_t>(at.theta_d)],
                                              axes.phi_d[static_cast<std::size_t>(at.phi_d)]));
          if (!value.isFinite().all()) throw_not_finite(cell, convention);
          take(i, cell, value);
        }
      });
}

}  // namespace

BrdfTable tabulate(const BrdfModel& model, RadiometricScale scale, IndexConvention convention) {
  BrdfTable table(convention, scale);
  evaluate_each(
      model, lattice::cells_above_horizon(convention), convention,
      [&](std::size_t, std::uint32_t cell, const Rgb& value) { table.set_value(cell, value); });
  return table;
}

std::vector<double> values_at_cells(const BrdfModel& model, std::span<const std::uint32_t> cells,
                                    IndexConvention convention) {
  auto planes = on_large_pages<std::vector<double>>(3 * cells.size(), 0.0);
  evaluate_each(
      model, cells, convention, [&](std::size_t position, std::uint32_t, const Rgb& value) {
        for (std::size_t channel = 0; channel < 3; ++channel) {
          planes[channel * cells.size() + position] = value[static_cast<Eigen::Index>(channel)];
        }
      });
  return planes;
}

std::vector<double> values_at_cells(const BrdfTable& table, std::span<const std::uint32_t> cells) {
  for (const std::uint32_t cell : cells) {
    if (cell >= lattice::kCells) {
      throw std::invalid_argument("cell " + std::to_string(cell) + " is not on the lattice");
    }
  }
  auto planes = on_large_pages<std::vector<double>>(3 * cells.size(), 0.0);
  const double* stored = table.stored_planes().data();
  for (std::size_t i = 0; i < cells.size(); ++i) {
    const std::size_t cell = cells[i];
    const bool valid = table.valid(cell);
    for (std::size_t channel = 0; channel < 3; ++channel) {
      planes[channel * cells.size() + i] =
          valid ? stored[cell + channel * lattice::kCells] * BrdfTable::kMerlScale[channel]
                : std::numeric_limits<double>::quiet_NaN();
    }
  }
  return planes;
}

}  // namespace gonio::brdf
