#pragma once

#include "gonio/modbus_stage/drive_profile.h"

namespace gonio::modbus_stage {

/// A drive that has everything a profile can say.
inline DriveProfile some_drive() {
  DriveProfile profile;
  profile.name = "some-drive";
  profile.start_time = std::chrono::milliseconds(10);
  profile.registers = {{.name = "status", .address = 0x10},
                       {.name = "position", .address = 0x12, .words = 2, .is_signed = true},
                       {.name = "alarm", .address = 0x14},
                       {.name = "limits", .address = 0x15},
                       {.name = "following", .address = 0x16, .is_signed = true, .scale = 0.1},
                       {.name = "pr0", .address = 0x20, .words = 6},
                       {.name = "command", .address = 0x30},
                       {.name = "resolution", .address = 0x40}};
  profile.status_register = "status";
  profile.position_register = "position";
  profile.alarm_register = "alarm";
  profile.limit_register = "limits";
  profile.following_error_register = "following";
  profile.max_following_error = 5.0;
  profile.fault.bit = 0;
  profile.enabled.bit = 1;
  profile.moving.bit = 2;
  profile.command_complete.bit = 3;
  profile.in_position.bit = 4;
  profile.homed.bit = 5;
  profile.limit_forward.bit = 0;
  profile.limit_reverse.bit = 1;
  profile.enable = {{"command", {"0x01"}}};
  profile.move = {
      {"pr0", {"target.high", "target.low", "speed", "acceleration", "deceleration", "0x10"}}};
  profile.home = {{"command", {"0x02"}, false}};
  profile.stop = {{"command", {"0x04"}}};
  profile.release = {{"command", {"0x00"}}};
  profile.reset_alarm = {{"command", {"0x08"}}};
  profile.expected = {{"resolution", 10000}};
  profile.alarm_texts = {{3, "over-temperature"}};
  return profile;
}

}  // namespace gonio::modbus_stage
