#pragma once

#include <optional>

#include "gonio/units/angle.h"

namespace gonio::devices {

/// What some rotation stages can tell after home(), an ability of its own: a drive has it when it
/// counts on while it searches the mark, so that it knows how far it drove until it was there.
///
/// Threads  As the stage's.
class HomingReport {
 public:
  virtual ~HomingReport() = default;
  HomingReport(const HomingReport&) = delete;
  HomingReport& operator=(const HomingReport&) = delete;

  /// Joint angle at which the axis stood when the last successful home() began, by the zero that
  /// this home() found. Less what the axis said before, it is what was lost since: steps, or a slip
  /// that its encoder does not see. Nothing before the first home().
  virtual std::optional<Angle> stood_before_home() const = 0;

 protected:
  HomingReport() = default;
};

}  // namespace gonio::devices
