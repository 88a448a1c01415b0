#include "calibration_plots.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string_view>
#include <vector>

#include "gonio/report/escaped.h"
#include "html.h"
#include "svg.h"

namespace gonio::calibration_report {
namespace {

using calibration::Estimate;
using report::Axis;
using report::escaped;
using report::number;
using report::Point;
using report::Svg;

struct Series {
  std::vector<Point> points;
  std::string_view css;
  bool joined = false;
};

constexpr double kWidth = 520.0;
constexpr double kHeight = 300.0;

/// Points and curves over common linear axes, which hold zero of y where `with_zero`.
std::string chart(std::string_view title, std::string_view x_name, std::string_view y_name,
                  const std::vector<Series>& series, bool with_zero = false) {
  constexpr double inf = std::numeric_limits<double>::infinity();
  Point low{inf, with_zero ? 0.0 : inf};
  Point high{-inf, with_zero ? 0.0 : -inf};
  for (const Series& s : series) {
    for (const Point& p : s.points) {
      if (!std::isfinite(p.x) || !std::isfinite(p.y)) continue;
      low = {std::min(low.x, p.x), std::min(low.y, p.y)};
      high = {std::max(high.x, p.x), std::max(high.y, p.y)};
    }
  }
  if (!(low.x <= high.x) || !(low.y <= high.y)) return {};
  const auto widen = [](double& a, double& b) {
    const double margin = b > a ? 0.06 * (b - a) : std::max(1e-9, 0.1 * std::abs(a));
    a -= margin;
    b += margin;
  };
  const Point data_low = low;
  const Point data_high = high;
  widen(low.x, high.x);
  widen(low.y, high.y);
  const Axis x = Axis::linear(low.x, high.x, 70.0, kWidth - 12.0);
  const Axis y = Axis::linear(low.y, high.y, kHeight - 46.0, 28.0);
  Svg svg(kWidth, kHeight, title);
  svg.rect({70.0, 28.0}, kWidth - 82.0, kHeight - 74.0, "frame");
  svg.text({70.0, 17.0}, "start", "plottitle", title);
  if (with_zero) svg.line({x(low.x), y(0.0)}, {x(high.x), y(0.0)}, "mirror");
  for (const double v : {data_low.y, 0.5 * (data_low.y + data_high.y), data_high.y}) {
    svg.line({x(low.x), y(v)}, {x(high.x), y(v)}, "ring");
    svg.text({64.0, y(v) + 4.0}, "end", "tick", number(v));
  }
  for (const double v : {data_low.x, 0.5 * (data_low.x + data_high.x), data_high.x}) {
    svg.text({x(v), kHeight - 30.0}, "middle", "tick", number(v));
  }
  svg.text({0.5 * kWidth, kHeight - 9.0}, "middle", "axis", x_name);
  svg.upward_text({14.0, 0.5 * kHeight - 9.0}, "axis", y_name);
  for (const Series& s : series) {
    std::vector<Point> places;
    for (const Point& p : s.points) places.push_back({x(p.x), y(p.y)});
    if (s.joined) {
      svg.polyline(places, s.css);
      continue;
    }
    for (std::size_t i = 0; i < places.size(); ++i) {
      svg.circle(places[i], 3.2, s.css,
                 fmt::format("{} {}", number(s.points[i].x), number(s.points[i].y)));
    }
  }
  return fmt::format("<figure>{}</figure>\n", svg.finish());
}

std::string section(std::string_view title, const std::string& words, const std::string& figures) {
  if (figures.empty() && words.empty()) return {};
  return fmt::format(
      "<section>\n<h2>{}</h2>\n<p class=\"quiet\">{}</p>\n<div class=\"duo\">{}"
      "</div>\n</section>\n",
      title, words, figures);
}

std::string with_sigma(const Estimate& e, std::string_view unit) {
  return fmt::format("{:.6g} ± {:.2g} {}", e.value, e.sigma, unit);
}

std::string sensor_section(const calibration::routine::Findings& found) {
  std::string figures;
  std::string words;
  if (found.photon_transfer) {
    const auto& ptc = *found.photon_transfer;
    Series used{{}, "dot g"};
    Series left_out{{}, "off b"};
    Series fit{{}, "curve r", true};
    for (const auto& p : ptc.points) {
      (p.used ? used : left_out).points.push_back({p.signal_dn, p.variance_dn2});
      if (p.used) fit.points.push_back({p.signal_dn, p.fitted_dn2});
    }
    figures += chart("Photon transfer: points in green follow the line", "signal (DN)",
                     "variance (DN²)", {fit, left_out, used});
    words += fmt::format("Gain {}, read noise {}{}. ", with_sigma(ptc.gain_dn_per_e, "DN/e"),
                         with_sigma(ptc.read_noise_e, "e"),
                         ptc.read_noise_is_bound ? " (upper bound)" : "");
  }
  if (found.linearity) {
    Series before{{}, "off r"};
    Series after{{}, "dot g"};
    for (const auto& p : found.linearity->points) {
      if (!p.in_range) continue;
      before.points.push_back({p.signal_dn, p.deviation_percent});
      after.points.push_back({p.signal_dn, p.after_curve_percent});
    }
    figures += chart("Linearity: rings before, dots after the curve", "signal (DN)",
                     "deviation (%)", {before, after}, true);
    words += fmt::format("Linearity error {:.4g} %, after the curve {:.4g} %. ",
                         found.linearity->le_percent, found.linearity->after_curve_percent);
  }
  if (found.darks) {
    words += fmt::format("Black level {}, dark current {}, bad pixels {:.4g} %. ",
                         with_sigma(found.darks->black_level_dn, "DN"),
                         with_sigma(found.darks->dark_current_dn_per_s, "DN/s"),
                         100.0 * found.darks->bad_fraction);
  }
  return section("Sensor", words, figures);
}

std::string axes_section(const CalibrationReportData& data) {
  std::string figures;
  std::string words;
  for (const auto& [step, seen] : data.observations) {
    for (const auto& record : seen.axes) {
      Series rising{{}, "dot g"};
      Series falling{{}, "dot b"};
      for (const auto& a : record.approaches) {
        (a.rising ? rising : falling)
            .points.push_back({a.target.degrees(), a.observed.degrees() - a.target.degrees()});
      }
      figures += chart(record.axis + ": arrivals, green from below, blue from above",
                       "target (deg)", "observed - target (deg)", {rising, falling});
      Series homings{{}, "dot g"};
      for (std::size_t i = 0; i < record.homings.size(); ++i) {
        homings.points.push_back({static_cast<double>(i + 1), record.homings[i].degrees()});
      }
      figures += chart(record.axis + ": one place after each homing", "homing", "deg", {homings});
      Series ring{{}, "curve b", true};
      for (const auto& r : record.settling) ring.points.push_back({r.time_s, r.angle.degrees()});
      figures += chart(record.axis + ": settling after a long move", "time (s)", "deg", {ring});
    }
  }
  for (const auto& [axis, r] : data.findings.repeatability) {
    words += fmt::format("{}: backlash {:.4g} ± {:.2g} deg. ", escaped(axis),
                         r.backlash.value.degrees(), r.backlash.sigma.degrees());
  }
  for (const auto& [axis, s] : data.findings.settling) {
    words += fmt::format("{}: settled after {:.3g} s. ", escaped(axis), s.settled_after_s);
  }
  return section("Axes", words, figures);
}

std::string lamp_section(const CalibrationReportData& data) {
  std::string figures;
  std::string words;
  if (const auto& lamp = data.findings.lamp) {
    Series readings{{}, "dot g"};
    Series fit{{}, "curve r", true};
    const auto seen = data.observations.find("warm_up");
    if (seen != data.observations.end()) {
      for (const auto& r : seen->second.lamp) {
        readings.points.push_back({r.time_s, r.value});
        const double rest = lamp->already_warm
                                ? 0.0
                                : lamp->amplitude.value * std::exp(-r.time_s / lamp->tau_s.value);
        fit.points.push_back({r.time_s, lamp->level.value * (1.0 - rest)});
      }
    }
    figures += chart("Warm-up and drift, with the fit", "time (s)", "reading", {fit, readings});
    words += fmt::format("Warm after {:.4g} s; drift {:.3g} % per 10 min. ",
                         lamp->warm_after_s.value, 100.0 * lamp->drift_per_10_min.value);
  }
  if (const auto& fields = data.findings.fields) {
    Series along_x{{}, "curve r", true};
    Series along_y{{}, "curve b", true};
    Series falloff{{}, "curve g", true};
    for (int i = -20; i <= 20; ++i) {
      const double t = 0.005 * i;
      const auto& f = fields->lamp_field;
      along_x.points.push_back({t, 1.0 + f.c10 * t + f.c20 * t * t});
      along_y.points.push_back({t, 1.0 + f.c01 * t + f.c02 * t * t});
      if (i < 0) continue;
      const double q = t * t;
      const auto& v = fields->vignetting;
      falloff.points.push_back({t, 1.0 + q * (v.v1 + q * (v.v2 + q * v.v3))});
    }
    figures += chart("Lamp field along x (red) and y (blue)", "tangent off axis", "intensity",
                     {along_x, along_y});
    figures += chart("Falloff of the lens", "tangent off axis", "responsivity", {falloff});
    words += fmt::format("Fields: residual {:.3g} % rms. ", 100.0 * fields->residual_rms);
  }
  if (const auto& stray = data.findings.stray) {
    words += fmt::format("Stray light {:.3g} % of white, at worst {:.3g} %. ",
                         100.0 * stray->fraction, 100.0 * stray->worst_fraction);
  }
  if (const auto& white = data.findings.white) {
    words += fmt::format("White: two takes differ by {:.3g} %. ", 100.0 * white->disagreement);
  }
  if (const auto& colour = data.findings.colour) {
    words += fmt::format("Colour: CIEDE2000 {:.3g} mean, {:.3g} at most. ", colour->mean_delta_e,
                         colour->max_delta_e);
  }
  return section("Light and white", words, figures);
}

std::string geometry_section(const CalibrationReportData& data) {
  std::string figures;
  std::string words;
  if (const auto& stage = data.findings.stage) {
    Series views{{}, "dot g"};
    Series left_out{{}, "off beyond"};
    for (std::size_t i = 0; i < stage->views.size(); ++i) {
      (stage->views[i].used ? views : left_out)
          .points.push_back({static_cast<double>(i + 1), stage->views[i].rms_px});
    }
    figures += chart("Board: misfit by view; red rings: left out", "view", "rms (px)",
                     {views, left_out}, true);
    words += fmt::format("Board {:.4g} px rms. ", stage->rms_px);
  }
  const auto vectors = [](const std::vector<Eigen::Vector2d>& residuals) {
    Series s{{}, "dot g"};
    for (const auto& r : residuals) s.points.push_back({r.x(), r.y()});
    return s;
  };
  if (const auto& arm = data.findings.lamp_arm) {
    figures += chart("Lamp in the mirror: residuals", "px across", "px down",
                     {vectors(arm->residual_px)}, true);
    words += fmt::format("Lamp arm {:.4g} px rms. ", arm->rms_px);
  }
  if (const auto& zeros = data.findings.zeros) {
    figures += chart("Mirror peaks: residual slopes", "x", "y", {vectors(zeros->residuals)}, true);
    words += fmt::format("Zeros off by {:.4g} deg in azimuth, {:.4g} deg in tilt. ",
                         zeros->azimuth.degrees(), zeros->tilt.degrees());
  }
  return section("Geometry", words, figures);
}

}  // namespace

std::string figure_sections(const CalibrationReportData& data) {
  return sensor_section(data.findings) + axes_section(data) + geometry_section(data) +
         lamp_section(data);
}

}  // namespace gonio::calibration_report
