#pragma once

#include <span>
#include <string_view>
#include <vector>

#include "gonio/brdf/directions.h"

namespace gonio::design {

/// A set of directions somebody has published.
struct PublishedSet {
  std::string_view name;  ///< "nielsen-10", "dtu-5", "seed-report-10", "near-field-2"
  std::string_view source;
  std::vector<brdf::HalfDiff>
      directions;  ///< as printed; one of seed-report-10 is below the horizon
};

/// All of them, in a fixed order. Built once and shared.
std::span<const PublishedSet> published_sets();

/// Throws std::invalid_argument naming those that exist.
const PublishedSet& published_set(std::string_view name);

}  // namespace gonio::design
