#pragma once

#include <vector>

#include "gonio/calibration/radiometry/white_view.h"
#include "gonio/calibration_report/calibration_report.h"
#include "gonio/page/svg.h"

namespace gonio::calibration_report {

/// One pixel of the white against what the calibrated instrument says of it.
struct WhiteResidual {
  double column = 0.0;
  double row = 0.0;
  double percent = 0.0;         ///< seen over predicted, less one
  page::Point off_lamp_axis{};  ///< deg about the lamp's own x and y
};

/// Of the views of the flat field; empty when they or the fields are not known, or belong to
/// another rig.
std::vector<WhiteResidual> white_residuals(const CalibrationReportData& data);

/// The convex hull, counter-clockwise, its first point again at the end; fewer than 3 points that
/// differ: empty. Source: Andrew, Information Processing Letters 9, 1979 (monotone chain).
std::vector<page::Point> convex_hull(std::vector<page::Point> points);

bool inside(const std::vector<page::Point>& hull, page::Point p);

}  // namespace gonio::calibration_report
