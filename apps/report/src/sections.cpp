#include "sections.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "page_parts.h"
#include "plots.h"

namespace gonio::report {
namespace {

struct Verdict {
  std::string_view css;
  std::string text;
};

Verdict verdict_of(const ReportData& data) {
  if (!data.verdict.empty()) {
    const std::string_view css = !data.trusted ? "remark" : *data.trusted ? "passed" : "failed";
    return {css, escaped(data.verdict)};
  }
  bool remark = !data.warnings.empty();
  for (const CheckResult& check : data.checks) {
    if (check.status == CheckStatus::failed) return {"failed", "A check failed: see below"};
    remark = remark || check.status == CheckStatus::remark;
  }
  if (remark) return {"remark", "Complete, with remarks"};
  return {"passed", data.checks.empty() ? "Complete" : "Complete, all checks passed"};
}

std::string tile(std::string_view value, std::string_view name) {
  return fmt::format("<div class=\"tile\"><b>{}</b><span>{}</span></div>\n", value, name);
}

std::string section(std::string_view title, std::string_view intro, std::string_view body) {
  if (body.empty()) return {};
  return fmt::format(
      "<section>\n<h2>{}</h2>\n{}{}</section>\n", title,
      intro.empty() ? std::string() : fmt::format("<p class=\"quiet\">{}</p>\n", intro), body);
}

std::string fact_list(const std::vector<Fact>& facts) {
  std::string list;
  for (const Fact& fact : facts) {
    list += fmt::format("<dt>{}</dt><dd>{}</dd>\n", escaped(fact.name), escaped(fact.value));
  }
  return list.empty() ? list : fmt::format("<dl>\n{}</dl>\n", list);
}

std::size_t pose_count(const ReportData& data) {
  if (!data.poses.empty()) return data.poses.size();
  std::set<int> poses;
  std::size_t single = 0;
  for (const FittedSample& s : data.samples) {
    if (s.sample.pose >= 0) {
      poses.insert(s.sample.pose);
    } else {
      ++single;
    }
  }
  return poses.size() + single;
}

/// Root mean square of the residuals in sigmas; NaN when none is known.
double residual_rms(const ReportData& data) {
  double sum = 0.0;
  int count = 0;
  for (const FittedSample& s : data.samples) {
    for (const double r : s.standardised) {
      if (!std::isfinite(r)) continue;
      sum += r * r;
      ++count;
    }
  }
  return std::sqrt(sum / count);
}

}  // namespace

std::string hero_section(const ReportData& data, const std::string& sphere) {
  const Verdict verdict = verdict_of(data);
  std::string tiles;
  const std::optional<quality::Comparison>& comparison = data.methods.front().comparison;
  if (comparison) {
    tiles += tile(number(comparison->lighting_a.psnr_db) + " dB", "image PSNR, lighting A");
    tiles += tile(fmt::format("{:.2f}", comparison->lighting_a.mean_delta_e),
                  "mean colour difference, CIEDE2000");
  }
  if (const std::size_t poses = pose_count(data); poses > 0) {
    tiles += tile(fmt::format("{}", poses), poses == 1 ? "pose measured" : "poses measured");
  }
  if (!data.samples.empty()) {
    tiles += tile(grouped(data.samples.size()), "directions sampled");
  }
  double seconds = 0.0;
  for (const TimingEntry& entry : data.timing) {
    seconds += std::isfinite(entry.seconds) ? std::max(0.0, entry.seconds) : 0.0;
  }
  if (seconds > 0.0) tiles += tile(duration(seconds), "whole session");

  return fmt::format(
      "<header class=\"hero\">\n<div class=\"sphere\">{}</div>\n<div>\n<div class=\"kicker\">BRDF "
      "measurement</div>\n<h1>{}</h1>\n{}<div class=\"verdict {}\">{}</div>\n"
      "<div class=\"tiles\">\n{}</div>\n</div>\n</header>\n",
      sphere, escaped(data.material),
      data.summary.empty() ? std::string()
                           : fmt::format("<p class=\"lead\">{}</p>\n", escaped(data.summary)),
      verdict.css, verdict.text, tiles);
}

std::string directions_section(const ReportData& data) {
  std::string body = direction_figures(data);
  if (!body.empty()) {
    body +=
        "<div class=\"key\"><span style=\"color:var(--light)\"><i class=\"o\"></i>light</span>"
        "<span style=\"color:var(--detector)\"><i class=\"o\"></i>detector</span>"
        "<span>small dots: directions inside one frame</span></div>\n";
  }
  if (!data.refused.empty()) {
    std::string rows;
    for (const RefusedDirection& r : data.refused) {
      rows += fmt::format(
          "<tr><td>{:.2f}° / {:.2f}° / {:.2f}°</td><td style=\"text-align:left\">{}"
          "</td></tr>\n",
          r.direction.theta_h.degrees(), r.direction.theta_d.degrees(), r.direction.phi_d.degrees(),
          escaped(r.reason));
    }
    body += fmt::format(
        "<div class=\"scroll\"><table>\n<thead><tr><th>Not measured (θh / θd / φd)</th>"
        "<th "
        "style=\"text-align:left\">why</th></tr></thead>\n<tbody>\n{}</tbody>\n</table></div>\n",
        rows);
  }
  return section(
      "Where it was measured",
      "Every point by its number, from 0 as everywhere. The material is isotropic, so the "
      "half vector is drawn towards the right.",
      body);
}

std::string samples_section(const ReportData& data) {
  std::string body = sample_figure(data);
  if (body.empty()) return {};
  const double rms = residual_rms(data);
  body +=
      "<div class=\"key\"><span style=\"color:var(--r)\"><i class=\"o\"></i>red</span>"
      "<span style=\"color:var(--g)\"><i class=\"o\"></i>green</span>"
      "<span style=\"color:var(--b)\"><i class=\"o\"></i>blue</span>"
      "<span>dots: measured, ± 1 standard uncertainty</span><span>dashes: the fit</span>";
  if (std::isfinite(rms)) body += fmt::format("<span>residuals: {:.2f} σ rms</span>", rms);
  body += "</div>\n";
  return section("Samples against the fit",
                 "What the camera saw, with its standard uncertainty, beside what the "
                 "reconstruction says there; below, the residuals in units of their standard "
                 "deviation, with the ±1 and ±2 bands.",
                 body);
}

std::string lobes_section(const ReportData& data) {
  std::string body = lobe_figures(data);
  body +=
      "<div class=\"key\"><span style=\"color:var(--r)\"><i></i>red</span>"
      "<span style=\"color:var(--g)\"><i></i>green</span>"
      "<span style=\"color:var(--b)\"><i></i>blue</span><span><i></i>reconstruction</span>";
  if (data.truth) body += "<span><i class=\"d\"></i>truth</span>";
  if (data.methods.front().lower_95) body += "<span>shaded: 95 % band</span>";
  body += "<span>dotted: mirror direction</span></div>\n";
  return section(
      "In the plane of incidence",
      "BRDF against the detector’s angle for four angles of incidence, and the luminance "
      "of the same curves as a polar diagram; logarithmic.",
      body);
}

std::string timing_section(const ReportData& data) {
  return section("Where the time went", "", timing_figure(data));
}

std::string checks_section(const ReportData& data) {
  std::string body;
  for (const CheckResult& check : data.checks) {
    std::string_view css = "passed";
    std::string_view word = "passed";
    switch (check.status) {
      case CheckStatus::passed:
        break;
      case CheckStatus::remark:
        css = word = "remark";
        break;
      case CheckStatus::failed:
        css = word = "failed";
        break;
      case CheckStatus::not_applicable:
        css = "na", word = "not applicable";
        break;
    }
    body += fmt::format("<li><em class=\"{}\">{}</em><b>{}</b><span>{}</span></li>\n", css, word,
                        escaped(check.name), escaped(check.detail));
  }
  if (!body.empty()) body = fmt::format("<ul class=\"checks\">\n{}</ul>\n", body);
  std::string warnings;
  for (const std::string& warning : data.warnings) {
    warnings += fmt::format("<li>{}</li>\n", escaped(warning));
  }
  if (!warnings.empty()) body += fmt::format("<ul class=\"warnings\">\n{}</ul>\n", warnings);
  return section("Checks and remarks", "", body);
}

std::string session_section(const ReportData& data) {
  return section("Session", "", fact_list(data.session));
}

std::string provenance_section(const ReportData& data) {
  std::string list = fact_list(data.provenance);
  if (!list.empty()) {
    list = fmt::format("<section class=\"provenance\">\n<h2>Provenance</h2>\n{}</section>\n", list);
  }
  return fmt::format("<!-- provenance -->\n{}<!-- /provenance -->\n", list);
}

}  // namespace gonio::report
