#pragma once

namespace gonio::devices {

/// A device that knows its own temperature, an extra ability of a camera, lamp or drive.
///
/// Threads  As the device itself.
/// Errors   DeviceError: as the device itself; Fault when this one has no such sensor.
class TemperatureSensor {
 public:
  virtual ~TemperatureSensor() = default;
  TemperatureSensor(const TemperatureSensor&) = delete;
  TemperatureSensor& operator=(const TemperatureSensor&) = delete;

  virtual double temperature_c() = 0;

 protected:
  TemperatureSensor() = default;
};

}  // namespace gonio::devices
