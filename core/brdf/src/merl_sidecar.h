#pragma once

#include <string>
#include <string_view>

#include "gonio/brdf/merl_file.h"

namespace gonio::brdf {

/// The text of a sidecar file. Throws std::invalid_argument when `sidecar.provenance_json` is not
/// one JSON object.
std::string sidecar_text(const MerlSidecar& sidecar);

}  // namespace gonio::brdf
