#include <algorithm>

#include "evaluate_steps.h"

namespace gonio::calibration::routine {
namespace {

constexpr double kMaxHomingScatter_deg = 0.005;
constexpr double kUsualScatter_deg = 0.002;

Estimate in_degrees(const AngleEstimate& angle) {
  return {angle.value.degrees(), angle.sigma.degrees()};
}

}  // namespace

Angle joint_scatter(const Findings& findings) {
  Angle largest = findings.repeatability.empty() ? Angle::from_degrees(kUsualScatter_deg) : Angle{};
  for (const auto& [axis, found] : findings.repeatability) {
    largest = std::max(largest, found.about_reading.value);
  }
  return largest;
}

Angle homing_scatter(const Findings& findings, const std::string& axis) {
  const auto found = findings.homing.find(axis);
  return found == findings.homing.end() ? Angle::from_degrees(kUsualScatter_deg)
                                        : found->second.value;
}

void evaluate_homing(const Observations& seen, const Known&, Findings& findings,
                     ResultBuilder& result) {
  for (const AxisRecord& record : seen.axes) {
    const AngleEstimate scatter = sensor::scatter(record.homings);
    findings.homing[record.axis] = scatter;
    result.parameter("axis." + record.axis + ".homing_scatter_deg", "deg", in_degrees(scatter));
    result.check(record.axis + " homing scatter (deg)", scatter.value.degrees(),
                 kMaxHomingScatter_deg);
  }
}

void evaluate_backlash(const Observations& seen, const Known&, Findings& findings,
                       ResultBuilder& result) {
  for (const AxisRecord& record : seen.axes) {
    const sensor::Repeatability found = sensor::fit_repeatability(record.approaches);
    findings.repeatability[record.axis] = found;
    result.parameter("axis." + record.axis + ".backlash_deg", "deg", in_degrees(found.backlash));
    result.parameter("axis." + record.axis + ".repeatability_deg", "deg",
                     in_degrees(found.unidirectional));
    result.parameter("axis." + record.axis + ".scatter_about_reading_deg", "deg",
                     in_degrees(found.about_reading));
    result.residual(record.axis + "_bidirectional_deg", found.bidirectional.degrees());
    for (instrument::AcceptanceCheck check : found.acceptance) {
      check.name = record.axis + " " + check.name;
      result.check(check);
    }
  }
}

void evaluate_settling(const Observations& seen, const Known&, Findings& findings,
                       ResultBuilder& result) {
  for (const AxisRecord& record : seen.axes) {
    const sensor::Settling found = sensor::fit_settling(record.settling);
    findings.settling[record.axis] = found;
    result.parameter("axis." + record.axis + ".settled_after_s", "s",
                     {found.settled_after_s, found.sigma_s});
    result.residual(record.axis + "_ring_deg", found.ring_amplitude.degrees());
    // Measured from where the axis said that it had settled.
    result.check(record.axis + " rings after it says it stands (s)", found.settled_after_s, 0.0);
  }
}

}  // namespace gonio::calibration::routine
