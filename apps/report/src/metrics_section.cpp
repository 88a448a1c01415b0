#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "page_parts.h"
#include "sections.h"

namespace gonio::report {
namespace {

/// Which way is better.
enum class Better { higher, lower, nearer_zero };

struct MetricRow {
  std::string_view name;
  std::string_view explanation;
  std::string_view unit;
  Better better;
  int decimals;
  bool minor;
  double (*value)(const quality::Comparison&);
};

using C = quality::Comparison;
constexpr std::array<MetricRow, 9> kRows = {{
    {"Image PSNR, lighting A", "rendered sphere against the truth’s", "dB", Better::higher, 1,
     false, [](const C& c) { return c.lighting_a.psnr_db; }},
    {"Image PSNR, lighting B", "", "dB", Better::higher, 1, false,
     [](const C& c) { return c.lighting_b.psnr_db; }},
    {"Colour difference, lighting A", "mean CIEDE2000", "", Better::lower, 2, false,
     [](const C& c) { return c.lighting_a.mean_delta_e; }},
    {"Colour difference, lighting B", "mean CIEDE2000", "", Better::lower, 2, false,
     [](const C& c) { return c.lighting_b.mean_delta_e; }},
    {"Weighted log RMSE", "by solid angle and cosines, over the whole lattice", "", Better::lower,
     3, false, [](const C& c) { return c.lattice.weighted_log_rmse; }},
    {"Weighted log bias", "below zero: too dark", "", Better::nearer_zero, 3, true,
     [](const C& c) { return c.lattice.weighted_log_bias; }},
    {"Grazing log RMSE", "65 to 85 degrees", "", Better::lower, 3, false,
     [](const C& c) { return c.lattice.grazing_log_rmse; }},
    {"Grazing log bias", "", "", Better::nearer_zero, 3, true,
     [](const C& c) { return c.lattice.grazing_log_bias; }},
    {"Raw RMSE", "ruled by the peak; says little about looks", "1/sr", Better::lower, 3, true,
     [](const C& c) { return c.lattice.raw_rmse_per_sr; }},
}};

double badness(const MetricRow& row, double value) {
  if (std::isnan(value)) return std::numeric_limits<double>::infinity();
  if (row.better == Better::higher) return -value;
  return row.better == Better::lower ? value : std::abs(value);
}

std::string shown(const MetricRow& row, double value) {
  if (!std::isfinite(value)) return number(value);
  const std::string digits = fmt::format("{:.{}f}", std::abs(value), row.decimals);
  return (value < 0.0 ? "−" : (row.better == Better::nearer_zero ? "+" : "")) + digits;
}

}  // namespace

std::string metrics_section(const ReportData& data) {
  std::vector<const MethodResult*> methods;
  for (const MethodResult& method : data.methods) {
    if (method.comparison) methods.push_back(&method);
  }
  if (methods.empty()) return {};

  std::string head = "<th></th>";
  for (const MethodResult* method : methods) {
    head +=
        fmt::format("<th>{}<small>{}</small></th>", escaped(method->name), escaped(method->note));
  }
  std::string body;
  for (const MetricRow& row : kRows) {
    double best = std::numeric_limits<double>::infinity();
    for (const MethodResult* m : methods)
      best = std::min(best, badness(row, row.value(*m->comparison)));
    body += fmt::format("<tr{}><td>{} <small>{}</small></td>", row.minor ? " class=\"minor\"" : "",
                        row.name, row.explanation);
    for (const MethodResult* m : methods) {
      const double value = row.value(*m->comparison);
      const bool is_best = methods.size() > 1 && badness(row, value) == best;
      body += fmt::format("<td{}>{}{}{}</td>", is_best ? " class=\"best\"" : "", shown(row, value),
                          row.unit.empty() ? "" : " ", row.unit);
    }
    body += "</tr>\n";
  }
  const quality::LatticeError& lattice = methods.front()->comparison->lattice;
  return fmt::format(
      "<section>\n<h2>How close it is</h2>\n<p class=\"quiet\">Against the known truth, over {} "
      "lattice cells{}. The best of each row is marked.</p>\n<div class=\"scroll\"><table>\n"
      "<thead><tr>{}</tr></thead>\n<tbody>\n{}</tbody>\n</table></div>\n</section>\n",
      grouped(lattice.cells),
      lattice.only_in_truth > 0
          ? fmt::format(" ({} more are known in the truth alone)", grouped(lattice.only_in_truth))
          : std::string(),
      head, body);
}

}  // namespace gonio::report
