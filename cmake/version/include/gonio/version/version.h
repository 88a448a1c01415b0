#pragma once

namespace gonio {

/// Version of the source tree, "0.1.0".
const char* version() noexcept;

/// Git revision this program was built from: twelve digits, "-dirty" added when files differed
/// from it, or "unknown" when built outside a clone.
const char* revision() noexcept;

}  // namespace gonio
