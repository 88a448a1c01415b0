#include "gonio/modbus_stage/stop_drive.h"

#include "drive_codec.h"

namespace gonio::modbus_stage {

void stop_drive(modbus_bus::ModbusBus& bus, const modbus_bus::Station& station,
                const DriveProfile& profile, modbus_bus::Attempts attempts) {
  for (const RegisterWrite& write : profile.stop) {
    const Register& to = *profile.find(write.register_name);
    bus.transact(station, write_request(to, write, {}), {.urgent = true, .attempts = attempts});
  }
}

}  // namespace gonio::modbus_stage
