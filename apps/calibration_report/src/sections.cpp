#include "sections.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "gonio/page/escaped.h"

namespace gonio::calibration_report {

using page::escaped;

std::string section(std::string_view title, const Facts& facts, const std::string& figures) {
  if (figures.empty() && facts.empty()) return {};
  std::string list;
  for (const auto& [name, value] : facts) {
    list += fmt::format("<dt>{}</dt><dd>{}</dd>\n", escaped(name), escaped(value));
  }
  if (!list.empty()) list = fmt::format("<dl>\n{}</dl>\n", list);
  return fmt::format("<section>\n<h2>{}</h2>\n{}<div class=\"duo\">{}</div>\n</section>\n",
                     escaped(title), list, figures);
}

std::string with_sigma(const calibration::Estimate& e, std::string_view unit) {
  std::string text = fmt::format("{:.6g} ± {:.2g}", e.value, e.sigma);
  if (std::isfinite(e.value) && std::isfinite(e.sigma) && e.sigma > 1e-9 &&
      std::abs(e.value) < 1e9) {
    const int decimals = std::clamp(1 - static_cast<int>(std::floor(std::log10(e.sigma))), 0, 9);
    text = fmt::format("{:.{}f} ± {:.{}f}", e.value, decimals, e.sigma, decimals);
  }
  return unit.empty() ? text : fmt::format("{} {}", text, unit);
}

const calibration::routine::Observations* seen_by(const CalibrationReportData& data,
                                                  const std::string& step) {
  const auto found = data.observations.find(step);
  return found == data.observations.end() ? nullptr : &found->second;
}

std::string figure_sections(const CalibrationReportData& data) {
  return sensor_section(data) + axes_section(data) + geometry_section(data) +
         lamp_geometry_section(data) + light_section(data) + colour_section(data);
}

}  // namespace gonio::calibration_report
