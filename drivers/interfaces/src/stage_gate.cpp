#include "gonio/devices/stage_gate.h"

#include <cmath>
#include <sstream>
#include <stdexcept>
#include <utility>

namespace gonio::devices {
namespace {

// Limits are inclusive; this much is rounding of degrees to radians (as in the rig description).
constexpr double kLimitToleranceRad = 1e-9;

}  // namespace

void AxisSetup::validate() const {
  const auto refuse = [&](const char* field, double found, const char* expected) {
    std::ostringstream text;
    text << "axis " << name << ": " << field << ": found " << found << ", expected " << expected;
    throw std::invalid_argument(text.str());
  };
  const auto positive = [](double value) { return value > 0.0 && std::isfinite(value); };
  if (name.empty()) throw std::invalid_argument("axis: name: found none, expected a name");
  if (!(limits.min < limits.max)) refuse("min_deg", limits.min.degrees(), "below max_deg");
  if (!(home >= limits.min && home <= limits.max)) {
    refuse("home_deg", home.degrees(), "min_deg to max_deg");
  }
  if (!positive(max_speed_deg_per_s)) {
    refuse("max_speed_deg_per_s", max_speed_deg_per_s, "above 0");
  }
  if (!positive(acceleration_deg_per_s2)) {
    refuse("acceleration_deg_per_s2", acceleration_deg_per_s2, "above 0");
  }
  if (settle.count() < 0) refuse("settle_ms", static_cast<double>(settle.count()), "0 or more");
}

StageGate::StageGate(std::string name, JointLimits limits)
    : name_(std::move(name)), limits_(limits) {}

StageGate::Hold StageGate::hold_for_move(Angle target) {
  Hold hold(mutex_);
  require_ready();
  const double radians = target.radians();
  // Written so that a NaN is refused.
  if (!(radians >= limits_.min.radians() - kLimitToleranceRad &&
        radians <= limits_.max.radians() + kLimitToleranceRad)) {
    std::ostringstream text;
    text << "target " << target.degrees() << " deg, limits " << limits_.min.degrees() << " .. "
         << limits_.max.degrees() << " deg";
    throw DeviceError(DeviceErrc::LimitViolation, name_, text.str());
  }
  return hold;
}

StageGate::Hold StageGate::hold_for_homing() {
  Hold hold(mutex_);
  require_not_stopped();
  homed_ = false;
  return hold;
}

StageGate::Hold StageGate::hold_for_stop() noexcept {
  ++stops_;
  return Hold(mutex_);
}

void StageGate::rearm(std::uint64_t stops) {
  rearmed_ = stops;
  require_not_stopped();
}

void StageGate::require_not_stopped() const {
  if (latched()) throw DeviceError(DeviceErrc::Stopped, name_, "stop() is latched; rearm() first");
}

void StageGate::require_ready() const {
  require_not_stopped();
  require_homed();
}

void StageGate::require_homed() const {
  if (!homed_) throw DeviceError(DeviceErrc::NotHomed, name_, "it has to be homed first");
}

}  // namespace gonio::devices
