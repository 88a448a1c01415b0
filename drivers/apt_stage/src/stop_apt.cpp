#include "gonio/apt_stage/stop_apt.h"

#include "gonio/apt_stage/apt_messages.h"

namespace gonio::apt_stage {

void stop_apt(usb_bus::ByteStream& port) { port.write(move_stop(StopMode::immediate)); }

}  // namespace gonio::apt_stage
