#pragma once

#include <string>

#include "gonio/report/report.h"

namespace gonio::report {

/// Figures of the page, each an inline SVG (or HTML) fragment; empty when there is nothing to show.

/// Two hemispheres seen from above, light and detector, and the plane of theta_h and theta_d.
std::string direction_figures(const ReportData& data);

/// Values with error bars against the fit on a logarithmic axis, residuals in sigmas below.
std::string sample_figure(const ReportData& data);

/// BRDF in the plane of incidence at four angles, and a polar view of the same.
std::string lobe_figures(const ReportData& data);

/// What the session's time went into.
std::string timing_figure(const ReportData& data);

}  // namespace gonio::report
