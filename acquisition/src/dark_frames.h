#pragma once

#include "capture_context.h"

namespace gonio::acquisition {

/// Frames of the shortest exposure behind the closed shutter. Throws Fault when one is bright: the
/// shutter is not closed.
void take_darks(const CaptureContext& context);

/// A frame behind the shutter, which is closed, for the light of the room; of a point, or -1.
void take_lamp_off(const CaptureContext& context, int point, std::chrono::nanoseconds exposure);

}  // namespace gonio::acquisition
