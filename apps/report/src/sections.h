#pragma once

#include <string>

#include "gonio/report/report.h"

namespace gonio::report {

/// Parts of the page, top to bottom; empty when there is nothing to show.

/// Title, verdict, a sphere and the figures one asks for first. `sphere` is an `<img>`.
std::string hero_section(const ReportData& data, const std::string& sphere);
/// Table of errors, one column per method that was compared.
std::string metrics_section(const ReportData& data);
std::string directions_section(const ReportData& data);
std::string samples_section(const ReportData& data);
std::string lobes_section(const ReportData& data);
std::string timing_section(const ReportData& data);
std::string checks_section(const ReportData& data);
std::string session_section(const ReportData& data);
/// Between the markers that set off what may differ between equal runs.
std::string provenance_section(const ReportData& data);

/// Spheres of truth, reconstruction and difference under all lightings; and the `<img>` for the
/// top of the page.
struct SphereSection {
  std::string hero_image;
  std::string section;
};
SphereSection sphere_section(const ReportData& data);

}  // namespace gonio::report
