#pragma once

#include "gonio/modbus_bus/modbus_bus.h"
#include "gonio/modbus_stage/drive_profile.h"

namespace gonio::modbus_stage {

/// Sends a drive its stop, before all else that waits on the line, and asks it nothing: also for
/// whoever knows no more of the axis than its profile (a watchdog). Throws DeviceError. Whoever
/// stops several axes gives each one attempt before any gets several.
void stop_drive(modbus_bus::ModbusBus& bus, const modbus_bus::Station& station,
                const DriveProfile& profile,
                modbus_bus::Attempts attempts = modbus_bus::Attempts::several);

}  // namespace gonio::modbus_stage
