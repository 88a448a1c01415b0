#pragma once

#include <cstdint>
#include <stop_token>
#include <string>
#include <vector>

#include "console.h"
#include "gonio/basis/basis.h"
#include "gonio/design/near_field.h"

namespace gonio::cli {

/// How near-field shots are taken, as options say it.
struct NearFieldWords {
  double fov_deg = 25.0;
  double camera_mm = 350.0;
  double lamp_mm = 0.0;    ///< 0: a directional lamp
  double sample_mm = 0.0;  ///< half width; 0: no edge in sight
};
design::NearFieldSetup near_field_setup(const NearFieldWords& words);

/// Chooses shots. A stop ends the search with the best so far.
std::vector<brdf::HalfDiff> choose_shots(const Console& console, const basis::Basis& basis,
                                         const design::NearFieldSetup& setup, int shots,
                                         std::uint64_t seed, const std::stop_token& stop);

/// How large the sample must be for these shots: usable share of the pixels and expected error
/// against its half width.
std::string near_field_text(const basis::Basis& basis, const std::vector<brdf::HalfDiff>& shots,
                            const design::NearFieldSetup& setup);

}  // namespace gonio::cli
