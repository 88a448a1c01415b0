#pragma once

#include <nlohmann/json.hpp>

#include "gonio/quality/metrics.h"

namespace gonio::cli {

/// Flat keys with units (docs/formats.md); a figure that is infinite or not known becomes null.
nlohmann::ordered_json to_json(const quality::Comparison& comparison);

}  // namespace gonio::cli
