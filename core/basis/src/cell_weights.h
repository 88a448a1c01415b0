#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "gonio/basis/log_mapping.h"
#include "gonio/brdf/brdf_table.h"

namespace gonio::basis::detail {

/// LogMapping::weight() of every cell above the horizon (bin centres). Throws
/// std::invalid_argument when the mapping's epsilon or floor is not positive and finite.
std::vector<float> cell_weights(const LogMapping& mapping);

/// Maps the cells above the horizon of a table, in parallel.
///
/// `out`    Three planes (R, G, B) of cells_above_horizon().size() values; where the table has
///          none, ln(eps).
/// Returns  The positions that have none, ascending.
/// Throws   std::invalid_argument for a stored value that is NaN or infinite.
std::vector<std::uint32_t> map_table(const brdf::BrdfTable& table, const LogMapping& mapping,
                                     std::span<const float> weights, std::span<float> out);

}  // namespace gonio::basis::detail
