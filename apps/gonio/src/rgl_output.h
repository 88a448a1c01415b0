#pragma once

#include <string>

#include "gonio/brdf/brdf_table.h"
#include "gonio/files/atomic_file.h"
#include "gonio/quality/metrics.h"

namespace gonio::cli {

/// Writes a table as an RGL material and says what the round trip costs: the table against what the
/// written numbers give back. `name` is what the table came from, for messages and the description.
/// Throws UsageError for a table that is not in SI.
quality::LatticeError write_rgl_of(const brdf::BrdfTable& table, const std::string& name,
                                   const std::string& out, files::Overwrite overwrite);

}  // namespace gonio::cli
