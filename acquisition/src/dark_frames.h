#pragma once

#include <chrono>
#include <string>

#include "capture_context.h"

namespace gonio::acquisition {

/// Frames of the shortest exposure behind the closed shutter. Throws Fault when one is bright: the
/// shutter is not closed.
void take_darks(const CaptureContext& context);

/// A frame behind the shutter, which is closed, for the light of the room; of a point, or -1.
/// Returns what that light did since the last one, as AmbientWatch::changed() of a target of these
/// `regions`.
std::string take_lamp_off(const CaptureContext& context, int point,
                          std::chrono::nanoseconds exposure, const Regions& regions,
                          double dimmest_dn_per_s);

}  // namespace gonio::acquisition
