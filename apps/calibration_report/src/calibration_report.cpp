#include "gonio/calibration_report/calibration_report.h"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <string_view>

#include "gonio/instrument/calibration_step.h"
#include "gonio/page/escaped.h"
#include "gonio/page/style.h"
#include "sections.h"

namespace gonio::calibration_report {
namespace {

using instrument::AcceptanceCheck;
using instrument::StepState;
using page::escaped;

constexpr std::string_view kStyle = R"css(
.meter{display:inline-block;width:110px;height:9px;border-radius:5px;background:var(--line);
overflow:hidden;vertical-align:middle;margin-right:8px}
.meter i{display:block;height:100%;background:var(--good)}.meter.over i{background:var(--bad)}
details{margin:3px 0}summary{cursor:pointer;color:var(--accent)}
td.text{text-align:left;white-space:normal;overflow-wrap:anywhere}
.duo{gap:26px 28px;margin-top:16px}.duo figure{min-width:0}
figcaption{color:var(--ink);font-weight:650;font-size:.95rem;text-align:left;margin:0 0 4px;
overflow-wrap:anywhere}
.hint{color:var(--quiet);font-size:.86rem;margin:4px 0 0}
.key{margin-top:4px;gap:4px 18px}
.key i.hollow{width:9px;height:9px;border:2px solid;border-radius:50%}
svg .cloud{fill:none;stroke-width:3.2;stroke-linecap:round;opacity:.42}
svg .light{stroke:none}
svg .above{fill:var(--r)}svg .below{fill:var(--b)}svg .much{fill:var(--accent)}
svg .above,svg .below,svg .much,svg .veil{shape-rendering:crispEdges}
svg .veil{fill:var(--card);opacity:.72}
svg .bar{fill:var(--accent)}
svg .limit{stroke:var(--bad);stroke-width:1.2;stroke-dasharray:5 4}
@media (max-width:820px){svg .tick{font-size:17px}svg .axis{font-size:18px}
.steps thead{display:none}.steps tr,.steps td{display:block}.steps tr{padding:8px 0;
border-bottom:1px solid var(--line)}.steps td{border:0;padding:2px 0}.steps .meter{width:80px}}
)css";

std::string utc(instrument::UtcSeconds time) {
  return fmt::format("{:%Y-%m-%d %H:%M} UTC",
                     fmt::gmtime(std::chrono::system_clock::to_time_t(time)));
}

std::string pill(std::string_view css, std::string_view word) {
  return fmt::format("<span class=\"verdict {}\">{}</span>", css, word);
}

/// Found against its limit: the bar is full at the limit, and red beyond it.
std::string check_line(const AcceptanceCheck& check) {
  const double share = check.limit > 0.0 ? check.found / check.limit : (check.passed() ? 0.0 : 1.0);
  return fmt::format(
      "<div><span class=\"meter{}\"><i style=\"width:{:.0f}%\"></i></span>{}: {:.6g} / {:.6g} "
      "<b>{}</b></div>\n",
      check.passed() ? "" : " over",
      100.0 * (std::isfinite(share) ? std::clamp(share, 0.0, 1.0) : 1.0), escaped(check.name),
      check.found, check.limit, check.passed() ? "passed" : "FAILED");
}

std::string parameters(const instrument::StepResult& result) {
  if (result.parameters.empty()) return {};
  std::string rows;
  for (std::size_t i = 0; i < result.parameters.size(); ++i) {
    const auto& p = result.parameters[i];
    const auto k = static_cast<Eigen::Index>(i);
    const bool known = k < result.covariance.rows() && k < result.covariance.cols();
    rows += fmt::format("<div>{} = {:.8g} ± {:.2g} {}</div>\n", escaped(p.name), p.value,
                        known ? std::sqrt(result.covariance(k, k)) : std::nan(""), escaped(p.unit));
  }
  return fmt::format("<details><summary>{} parameters</summary>\n{}</details>\n",
                     result.parameters.size(), rows);
}

const RefusedStep* refusal_of(const CalibrationReportData& data, std::string_view step) {
  for (const RefusedStep& r : data.refused) {
    if (r.step == step) return &r;
  }
  return nullptr;
}

bool any_failed(const CalibrationReportData& data) {
  const auto failed = [](const auto& checks) {
    return std::any_of(checks.begin(), checks.end(),
                       [](const AcceptanceCheck& c) { return !c.passed(); });
  };
  return (data.findings.verification && !data.findings.verification->passed) ||
         std::any_of(data.archive.results.begin(), data.archive.results.end(),
                     [&](const auto& r) { return failed(r.checks); });
}

/// Of the room, as the steps were told it.
std::string temperatures(const instrument::CalibrationArchive& archive) {
  std::vector<double> told;
  for (const instrument::StepResult& result : archive.results) {
    if (result.temperature_deg_c) told.push_back(*result.temperature_deg_c);
  }
  if (told.empty()) return {};
  const auto [low, high] = std::minmax_element(told.begin(), told.end());
  const std::string most = *high > *low ? fmt::format(" to {:.1f}", *high) : std::string();
  return fmt::format("<dt>Temperature</dt><dd>{:.1f}{} &deg;C</dd>\n", *low, most);
}

std::string header(const CalibrationReportData& data) {
  std::map<StepState, int> count;
  std::optional<instrument::UtcSeconds> until;
  for (const auto& step : instrument::calibration_steps()) {
    ++count[instrument::state_of(data.archive, step.name, data.now)];
    if (const auto* r = instrument::find_result(data.archive, step.name)) {
      until = until ? std::min(*until, r->valid_until) : r->valid_until;
    }
  }
  std::string_view css = "passed";
  std::string words = "Passed: every step is valid";
  const int open = count[StepState::missing] + count[StepState::stale] + count[StepState::expired];
  if (!data.refused.empty() || any_failed(data)) {
    css = "failed";
    words = data.refused.empty() ? "Failed: a check is beyond its limit"
                                 : fmt::format("Refused: {} of the steps", data.refused.size());
  } else if (open > 0) {
    css = "remark";
    words = fmt::format("Incomplete: {} missing, {} stale, {} expired", count[StepState::missing],
                        count[StepState::stale], count[StepState::expired]);
  }
  std::string facts;
  facts += temperatures(data.archive);
  for (const auto& [device, serial] : data.archive.serials) {
    facts += fmt::format("<dt>{}</dt><dd>{}</dd>\n", escaped(device), escaped(serial));
  }
  return fmt::format(
      "<section>\n<p class=\"kicker\">Calibration</p>\n<h1>{}</h1>\n{}\n<dl>\n<dt>As of</dt>"
      "<dd>{}</dd>\n<dt>Valid until</dt><dd>{}</dd>\n{}</dl>\n</section>\n",
      escaped(data.rig), pill(css, words), utc(data.now),
      open == 0 && until ? utc(*until) : std::string("not valid as a whole"), facts);
}

std::string step_row(const CalibrationReportData& data, const instrument::CalibrationStep& step) {
  const auto* result = instrument::find_result(data.archive, step.name);
  const StepState state = instrument::state_of(data.archive, step.name, data.now);
  std::string detail;
  std::string badge = pill(state == StepState::valid     ? "passed"
                           : state == StepState::missing ? "na"
                                                         : "remark",
                           instrument::to_string(state));
  if (const RefusedStep* refused = refusal_of(data, step.name)) {
    badge = pill("failed", "refused");
    detail += fmt::format("<p><b>Refused:</b> {}</p>\n", escaped(refused->why));
  }
  if (result != nullptr) {
    for (const AcceptanceCheck& c : result->checks) detail += check_line(c);
    detail += parameters(*result);
    for (const std::string& note : result->notes) {
      detail += fmt::format("<p class=\"quiet\">{}</p>\n", escaped(note));
    }
  }
  return fmt::format(
      "<tr><td><b>{}</b><br><small>{}</small></td><td class=\"text\">{}<br><small>{}</small></td>"
      "<td class=\"text\">{}</td></tr>\n",
      step.name, step.finds, badge,
      result == nullptr
          ? std::string()
          : fmt::format("{}<br>until {}", utc(result->finished), utc(result->valid_until)),
      detail);
}

std::string verification_section(const CalibrationReportData& data) {
  if (!data.findings.verification) return {};
  const auto& v = *data.findings.verification;
  std::string body = pill(v.passed ? "passed" : "failed", v.passed ? "passed" : "failed");
  if (!v.passed) {
    body += fmt::format("<p><b>Likeliest cause: {}</b>. {} (explains {:.0f} %)</p>\n",
                        escaped(calibration::to_string(v.cause)), escaped(v.explanation),
                        100.0 * v.explained);
  }
  for (const AcceptanceCheck& c : v.checks) body += check_line(c);
  return fmt::format("<section>\n<h2>Verification</h2>\n{}</section>\n", body);
}

}  // namespace

std::map<std::string, calibration::routine::Observations> read_observations(
    const instrument::CalibrationArchive& archive, const calibration::routine::Folder& folder) {
  std::map<std::string, calibration::routine::Observations> all;
  for (const instrument::StepResult& result : archive.results) {
    all[result.step] = calibration::routine::read_observations(result, folder);
  }
  return all;
}

std::string html(const CalibrationReportData& data) {
  std::string rows;
  for (const auto& step : instrument::calibration_steps()) rows += step_row(data, step);
  return fmt::format(
             "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
             "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n"
             "<title>{} · calibration</title>\n<style>{}{}</style>\n</head>\n<body>\n<main>\n",
             escaped(data.rig), page::style_sheet(), kStyle) +
         header(data) + verification_section(data) +
         "<section>\n<h2>Steps</h2>\n<table class=\"steps\">\n" + rows + "</table>\n</section>\n" +
         figure_sections(data) + "</main>\n</body>\n</html>\n";
}

}  // namespace gonio::calibration_report
