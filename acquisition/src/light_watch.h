#pragma once

#include <chrono>

#include "gonio/acquisition/guarded_devices.h"

namespace gonio::acquisition {

/// Reads the lamp's monitor before, after and during the exposures of one bracket: whether its
/// light was steady, whatever the period it flickers with.
///
/// Periods  A reading before and one after a frame are alike where the time between them is a
///          multiple of the period. So the monitor is read eight times more within each exposure,
///          at uneven intervals, the longest of which is 0.15 of it: a light that is on and off in
///          turn for half a period each reads differently at two of them where the period is longer
///          than an eighth of the exposure; of shorter ones one in several hundred brackets is
///          missed. A monitor that takes longer over a reading is read as often as there is time;
///          it averages over what it takes.
/// Threads  One.
/// Errors   devices::DeviceError of readings before and after.
class LightWatch {
 public:
  /// Reads once. `devices` must outlive it.
  explicit LightWatch(GuardedDevices& devices);

  /// To be called while the light of a frame is gathered. Never throws: a monitor that fails now is
  /// asked no more within this exposure, and by read() as often as any device.
  void during(std::chrono::nanoseconds exposure) noexcept;
  double read();

  double lowest() const { return lowest_; }
  double highest() const { return highest_; }

 private:
  void see(double reading);

  GuardedDevices& devices_;
  double lowest_;
  double highest_;
};

}  // namespace gonio::acquisition
