#pragma once

#include "bracket.h"

namespace gonio::acquisition {

/// Whether the camera sees any of the white at these joints with a pixel that counts. The same
/// answer as white_regions(), usually without looking at every pixel.
bool white_in_view(const instrument::Instrument& instrument, const SessionOptions& options,
                   const rig::Joints& joints);

/// The part of the image the white fills at these joints; empty when it is out of view.
Regions white_regions(const instrument::Instrument& instrument, const SessionOptions& options,
                      const rig::Joints& joints);

}  // namespace gonio::acquisition
