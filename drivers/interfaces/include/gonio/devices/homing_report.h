#pragma once

#include <optional>

#include "gonio/units/angle.h"

namespace gonio::devices {

/// Where an axis stood when a homing began.
struct StoodBeforeHome {
  Angle angle;   ///< of the joint, by the zero that this homing found
  Angle within;  ///< off by this at most, because the count was read only now and then
};

/// What some rotation stages can tell after home(), an ability of its own: a drive has it when it
/// counts on while it searches the mark, so that it knows how far it drove until it was there.
///
/// Threads  As the stage's.
class HomingReport {
 public:
  virtual ~HomingReport() = default;
  HomingReport(const HomingReport&) = delete;
  HomingReport& operator=(const HomingReport&) = delete;

  /// Whether this very axis has the ability: not every drive of a family does.
  virtual bool tells() const = 0;

  /// As of the last home(). Less what the axis said before, it is what was lost since: steps, or a
  /// slip that its encoder does not see. Nothing before the first home(), after one that failed
  /// before the mark was found for certain, and where the axis cannot tell.
  virtual std::optional<StoodBeforeHome> stood_before_home() const = 0;

 protected:
  HomingReport() = default;
};

}  // namespace gonio::devices
