#pragma once

#include <string>

#include "gonio/calibration_report/calibration_report.h"

namespace gonio::calibration_report {

/// Sections with figures, each left out when its step has found nothing.
std::string figure_sections(const CalibrationReportData& data);

}  // namespace gonio::calibration_report
