#include "gonio/version/version.h"

#include "revision.h"

namespace gonio {

const char* version() noexcept { return GONIO_VERSION; }

const char* revision() noexcept { return GONIO_REVISION; }

}  // namespace gonio
