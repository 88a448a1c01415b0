#pragma once

#include "gonio/usb_bus/byte_stream.h"

namespace gonio::apt_stage {

/// Sends a unit the immediate stop and asks it nothing: for whoever knows no more of the axis than
/// its port (a watchdog). Throws DeviceError.
void stop_apt(usb_bus::ByteStream& port);

}  // namespace gonio::apt_stage
