#pragma once

#include "gonio/quality/synthetic_samples.h"
#include "rig_file.h"

namespace gonio::cli {

/// What one frame of the rig shows of a sample.
quality::PatchGeometry patch_of(const RigFile& rig);

}  // namespace gonio::cli
