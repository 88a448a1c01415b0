#pragma once

#include "gonio/instrument/camera_model.h"
#include "gonio/rig/rig_description.h"

namespace gonio::calibration {

/// A rig and the lens that was found with it. They are to be taken together: most of an error of
/// the focal length, say, is made good by one of the camera's place.
struct CalibratedRig {
  rig::RigDescription rig;
  instrument::CameraModel camera;
};

}  // namespace gonio::calibration
