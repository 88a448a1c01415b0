#include <fmt/format.h>

#include "chart.h"
#include "sections.h"

namespace gonio::calibration_report {
namespace {

constexpr double kMilli = 1000.0;  // deg to mdeg

std::string figures_of(const calibration::routine::AxisRecord& record) {
  Series rising{{}, "dot g", "arrived from below"};
  Series falling{{}, "dot b", "from above"};
  for (const auto& a : record.approaches) {
    (a.rising ? rising : falling)
        .points.push_back({a.target.degrees(), kMilli * (a.observed - a.target).degrees()});
  }
  Angle mean;
  for (const Angle home : record.homings) {
    mean += home / static_cast<double>(record.homings.size());
  }
  Series homings{{}, "dot g", ""};
  for (std::size_t i = 0; i < record.homings.size(); ++i) {
    homings.points.push_back(
        {static_cast<double>(i + 1), kMilli * (record.homings[i] - mean).degrees()});
  }
  // Where it came to rest: the mean of the last quarter, as the fit takes it.
  const std::size_t last = (record.settling.size() + 3) / 4;
  Angle rest;
  for (std::size_t i = record.settling.size() - last; i < record.settling.size(); ++i) {
    rest += record.settling[i].angle / static_cast<double>(last);
  }
  Series ring{{}, "curve b", ""};
  for (const auto& r : record.settling) {
    ring.points.push_back({r.time_s, kMilli * (r.angle - rest).degrees()});
  }
  return chart({record.axis + ": arrivals", "target (deg)", "observed − target (mdeg)",
                "The gap between the two clouds is the play."},
               {rising, falling}) +
         chart(
             {record.axis + ": one place after each homing", "homing", "off their mean (mdeg)", ""},
             {homings}, {.with_zero = true}) +
         chart(
             {record.axis + ": settling after a long move", "time since it said it stands (s)",
              "off where it rests (mdeg)",
              "Of an axis that rings the points swing about zero by more than their scatter, less "
              "and less; the step refuses 2 mdeg."},
             {ring}, {.with_zero = true});
}

}  // namespace

std::string axes_section(const CalibrationReportData& data) {
  Facts facts;
  for (const auto& [axis, r] : data.findings.repeatability) {
    facts.emplace_back(axis + ": backlash",
                       with_sigma({r.backlash.value.degrees(), r.backlash.sigma.degrees()}, "deg"));
  }
  for (const auto& [axis, s] : data.findings.settling) {
    facts.emplace_back(axis + ": settled after", fmt::format("{:.3g} s", s.settled_after_s));
  }
  std::string figures;
  for (const auto& [step, seen] : data.observations) {
    for (const auto& record : seen.axes) figures += figures_of(record);
  }
  return section("Axes", facts, figures);
}

}  // namespace gonio::calibration_report
