#pragma once

#include "gonio/devices/device_error.h"

namespace gonio::devices {

/// A device whose alarm can be cleared over the wire, an extra ability of some drives.
///
/// Threads  As the device itself.
/// Errors   DeviceError: Fault when the alarm stands on; otherwise as the device itself.
class ResettableAlarm {
 public:
  virtual ~ResettableAlarm() = default;
  ResettableAlarm(const ResettableAlarm&) = delete;
  ResettableAlarm& operator=(const ResettableAlarm&) = delete;

  /// Once a person has looked. The axis is not homed afterwards. Nothing happens without an alarm.
  virtual void reset_alarm() = 0;

 protected:
  ResettableAlarm() = default;
};

}  // namespace gonio::devices
