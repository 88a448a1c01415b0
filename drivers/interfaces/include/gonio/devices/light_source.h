#pragma once

#include <string>
#include <vector>

#include "gonio/devices/device_error.h"

namespace gonio::devices {

/// One separately switched colour of a lamp.
struct LightChannel {
  std::string name;            ///< "R", "G", "B", "white", ...
  double wavelength_nm = 0.0;  ///< centre; 0 for white
};

/// The lamp on the arm: named channels behind one shutter.
///
/// State    Constructed dark (shutter closed). At most one channel is lit at a time.
/// Threads  One controlling thread; only close_shutter() may be called from any other.
/// Errors   DeviceError: Timeout, Disconnected, Fault; std::invalid_argument for a channel that
///          does not exist.
class LightSource {
 public:
  virtual ~LightSource() = default;
  LightSource(const LightSource&) = delete;
  LightSource& operator=(const LightSource&) = delete;

  virtual const std::string& name() const = 0;
  virtual std::vector<LightChannel> channels() const = 0;

  /// Selects a channel and opens the shutter; returns when the light is steady.
  virtual void light(const std::string& channel) = 0;

  /// Dark now. Safe from any thread and from destructors.
  virtual void close_shutter() noexcept = 0;

 protected:
  LightSource() = default;
};

/// A photodiode that watches the lamp itself, not the sample.
///
/// Threads  One controlling thread.
class LampMonitor {
 public:
  virtual ~LampMonitor() = default;
  LampMonitor(const LampMonitor&) = delete;
  LampMonitor& operator=(const LampMonitor&) = delete;

  virtual const std::string& name() const = 0;

  /// Reading proportional to the lit channel's output, arbitrary unit, dark level removed.
  virtual double read() = 0;

 protected:
  LampMonitor() = default;
};

}  // namespace gonio::devices
