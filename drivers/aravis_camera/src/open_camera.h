#pragma once

#include <arv.h>

#include "arrivals.h"
#include "gonio/aravis_camera/options.h"

namespace gonio::aravis_camera {

/// The camera under our control, one attempt. Throws DeviceError: Disconnected where nobody answers
/// or another program has it, Protocol where what answers is no camera.
Handle<ArvCamera> open_camera(const AravisCameraOptions& options);

}  // namespace gonio::aravis_camera
