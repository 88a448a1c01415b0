#pragma once

#include <numbers>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "gonio/calibration/result/estimate.h"
#include "gonio/calibration_report/calibration_report.h"

namespace gonio::calibration_report {

/// Millidegrees of a rad, or of a slope that is small.
inline constexpr double kMilliDegrees = 1000.0 * 180.0 / std::numbers::pi;

/// All sections with figures, each left out when its steps have found nothing.
std::string figure_sections(const CalibrationReportData& data);

/// Numbers of a section, name and value; escaped where they are written.
using Facts = std::vector<std::pair<std::string, std::string>>;

/// Empty when there is nothing to show.
std::string section(std::string_view title, const Facts& facts, const std::string& figures);

/// "0.3912 ± 0.0020 DN/e": both to the second digit of sigma.
std::string with_sigma(const calibration::Estimate& estimate, std::string_view unit);

/// What a step has seen; null when that is not known.
const calibration::routine::Observations* seen_by(const CalibrationReportData& data,
                                                  const std::string& step);

// One per subject.
std::string sensor_section(const CalibrationReportData& data);
std::string axes_section(const CalibrationReportData& data);
std::string geometry_section(const CalibrationReportData& data);
std::string lamp_geometry_section(const CalibrationReportData& data);
std::string light_section(const CalibrationReportData& data);
std::string colour_section(const CalibrationReportData& data);

}  // namespace gonio::calibration_report
