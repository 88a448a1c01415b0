#include "gonio/brdf/brdf_table.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>
#include <utility>

#include "large_pages.h"

namespace gonio::brdf {
namespace {

constexpr double kInvalid = -1.0;

}  // namespace

BrdfTable::BrdfTable(IndexConvention convention, RadiometricScale scale)
    : stored_(on_large_pages<std::vector<double>>(3 * lattice::kCells, kInvalid)),
      convention_(convention),
      scale_(scale) {}

BrdfTable::BrdfTable(std::vector<double> stored_planes, IndexConvention convention,
                     RadiometricScale scale)
    : stored_(std::move(stored_planes)), convention_(convention), scale_(scale) {
  if (stored_.size() != 3 * lattice::kCells) {
    throw std::invalid_argument("BrdfTable: " + std::to_string(stored_.size()) +
                                " stored numbers, expected " + std::to_string(3 * lattice::kCells));
  }
}

bool BrdfTable::valid(std::size_t cell) const {
  return stored_[cell] >= 0.0 && stored_[cell + lattice::kCells] >= 0.0 &&
         stored_[cell + 2 * lattice::kCells] >= 0.0;
}

Rgb BrdfTable::value(std::size_t cell) const {
  if (!valid(cell)) return Rgb::Constant(std::numeric_limits<double>::quiet_NaN());
  return {stored_[cell] * kMerlScale[0], stored_[cell + lattice::kCells] * kMerlScale[1],
          stored_[cell + 2 * lattice::kCells] * kMerlScale[2]};
}

void BrdfTable::set_value(std::size_t cell, const Rgb& per_sr) {
  if (!per_sr.isFinite().all()) {
    throw std::invalid_argument("BrdfTable: value of cell " + std::to_string(cell) +
                                " is not finite");
  }
  for (std::size_t channel = 0; channel < 3; ++channel) {
    // Divided, not multiplied by an inverse: two roundings at most, hence within 1 ulp.
    stored_[cell + channel * lattice::kCells] =
        std::max(0.0, per_sr[static_cast<Eigen::Index>(channel)]) / kMerlScale[channel];
  }
}

void BrdfTable::set_invalid(std::size_t cell) {
  for (std::size_t channel = 0; channel < 3; ++channel) {
    stored_[cell + channel * lattice::kCells] = kInvalid;
  }
}

BrdfTable BrdfTable::rescaled(double factor, RadiometricScale to) && {
  if (!(factor > 0.0 && std::isfinite(factor))) {
    throw std::invalid_argument("BrdfTable: scale factor " + std::to_string(factor) +
                                ", expected a finite number above 0");
  }
  for (double& value : stored_) {
    if (value > 0.0) value *= factor;  // negatives mark cells without a value
  }
  scale_ = to;
  return std::move(*this);
}

}  // namespace gonio::brdf
