#pragma once

#include <filesystem>
#include <string>

#include "gonio/basis/reconstruct.h"
#include "gonio/console/console.h"
#include "gonio/samples/samples.h"

namespace gonio::cli {

/// Samples from a CSV file, or from a session archive, which is reduced as its rig file says.
samples::SampleSet samples_input(const Console& console, const std::filesystem::path& path);

/// Throws UsageError, with a way out, unless samples and basis are in one radiometric scale.
void require_scale_of(const basis::Basis& basis, const std::string& basis_name,
                      brdf::RadiometricScale scale, const std::string& samples_name);

/// From --method and --eta ("auto" or a number). Throws UsageError.
basis::ReconstructOptions reconstruct_options(const std::string& method, const std::string& eta);

}  // namespace gonio::cli
