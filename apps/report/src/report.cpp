#include "gonio/report/report.h"

#include <fmt/format.h>

#include <stdexcept>

#include "page_parts.h"
#include "sections.h"

namespace gonio::report {
namespace {

void check(const ReportData& data) {
  if (data.methods.empty() || !data.methods.front().table) {
    throw std::invalid_argument("report: the first method has no BRDF table");
  }
  const brdf::BrdfTable& found = *data.methods.front().table;
  for (const MethodResult& method : data.methods) {
    if (method.table && method.table->scale() != found.scale()) {
      throw std::invalid_argument("report: the tables' radiometric scales differ");
    }
  }
  if (data.truth &&
      (data.truth->scale() != found.scale() || data.truth->convention() != found.convention())) {
    throw std::invalid_argument(
        "report: the truth's radiometric scale or index convention is not the result's");
  }
}

}  // namespace

std::string html(const ReportData& data) {
  check(data);
  const SphereSection spheres = sphere_section(data);
  std::string page = fmt::format(
      "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
      "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n"
      "<title>{} · BRDF measurement</title>\n<style>{}</style>\n</head>\n<body>\n<main>\n",
      escaped(data.material), style_sheet());
  page += hero_section(data, spheres.hero_image);
  page += spheres.section;
  page += metrics_section(data);
  page += samples_section(data);
  page += directions_section(data);
  page += lobes_section(data);
  page += checks_section(data);
  page += timing_section(data);
  page += session_section(data);
  page += provenance_section(data);
  page += "</main>\n</body>\n</html>\n";
  return page;
}

void write_report(const std::filesystem::path& path, const ReportData& data,
                  files::Overwrite overwrite) {
  files::AtomicFile file(path, overwrite);
  file.write(html(data));
  file.commit();
}

}  // namespace gonio::report
