#pragma once

#include "capture_context.h"

namespace gonio::acquisition {

/// What the frames of a point came to.
struct PointFrames {
  PointOutcome outcome = PointOutcome::Failed;
  std::string unsteady;  ///< why the light, the lamp's or the room's, was not; empty: it was
};

/// Takes the brackets of all channels where the axes stand, and a lamp-off frame. `expected`: the
/// sample as it is known now, if more is known than in the beginning.
PointFrames take_point_frames(const CaptureContext& context, int point,
                              const std::optional<ExpectedSample>& expected);

}  // namespace gonio::acquisition
