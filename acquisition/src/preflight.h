#pragma once

#include "bracket.h"

namespace gonio::acquisition {

/// Where the white is measured: 45:0 (theta_i = 45, theta_o = 0 deg), or the nearest of 30
/// directions to it that the rig reaches from home and back. Throws PreflightError when there is
/// none.
rig::Joints white_joints(const rig::RigDescription& rig);

/// The part of the image the white fills at these joints; empty when it is out of view.
Regions white_regions(const instrument::Instrument& instrument, const SessionOptions& options,
                      const rig::Joints& joints);

}  // namespace gonio::acquisition
