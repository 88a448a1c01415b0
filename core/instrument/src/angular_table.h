#pragma once

#include "gonio/instrument/instrument.h"

namespace gonio::instrument {

/// Throws std::invalid_argument naming the field: nodes that do not ascend or lie outside their
/// range, factors that are not positive, or not one for every combination of nodes.
void require_table(const AngularTable& table);

}  // namespace gonio::instrument
