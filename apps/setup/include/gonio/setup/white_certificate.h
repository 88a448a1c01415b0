#pragma once

#include <filesystem>

#include "gonio/instrument/instrument.h"

namespace gonio::cli {

/// Reads the angular table of a white reference: a CSV file with the columns theta_i_deg,
/// theta_o_deg, delta_phi_deg and factor, one row for every combination of their nodes, in any
/// order.
///
/// Hostile  The file is untrusted: at most 100,000 rows, and what CsvReader refuses.
/// Throws   FileError; DataFormatError with path, line and column.
instrument::AngularTable read_white_certificate(const std::filesystem::path& path);

}  // namespace gonio::cli
