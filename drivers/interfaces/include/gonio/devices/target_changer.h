#pragma once

#include <string>
#include <string_view>

#include "gonio/devices/device_error.h"

namespace gonio::devices {

/// What can lie in the sample plane. A session needs the first two; calibration the others.
enum class Target {
  sample,
  white,  ///< the white reference
  board,  ///< ChArUco board
  /// The same, turned by half a turn in its mount: how it leans there leans the other way.
  board_turned,
  mirror,         ///< flat first-surface mirror
  mirror_turned,  ///< as board_turned
  black_trap,     ///< swallows what falls on it
  black_glass,    ///< polished, reflects as Fresnel's equations say
  colour_chart
};

/// As in files: "white", "black_trap".
std::string_view to_string(Target target);

/// For a person: "white reference", "black trap".
std::string_view in_words(Target target);

/// Puts a target into the sample plane: a motorised changer, or a person who is told what to mount
/// and confirms (the two look the same to a session; only the time differs).
///
/// Threads  One controlling thread.
/// Errors   DeviceError: Timeout, Fault, Stopped (the person declined).
class TargetChanger {
 public:
  virtual ~TargetChanger() = default;
  TargetChanger(const TargetChanger&) = delete;
  TargetChanger& operator=(const TargetChanger&) = delete;

  virtual const std::string& name() const = 0;
  virtual Target mounted() const = 0;

  /// Returns when `target` lies in the plane. Axes must stand still and the shutter be closed.
  virtual void mount(Target target) = 0;

 protected:
  TargetChanger() = default;
};

}  // namespace gonio::devices
