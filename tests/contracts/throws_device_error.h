#pragma once

#include <gmock/gmock.h>

#include "gonio/devices/device_error.h"

namespace gonio::contracts {

/// Matches a callable that throws a DeviceError of this code.
inline auto ThrowsDeviceError(devices::DeviceErrc code) {
  return testing::Throws<devices::DeviceError>(
      testing::Property("code", &devices::DeviceError::code, code));
}

}  // namespace gonio::contracts
