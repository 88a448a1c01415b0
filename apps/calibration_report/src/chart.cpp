#include "chart.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "gonio/page/escaped.h"
#include "gonio/page/html.h"

namespace gonio::calibration_report {
namespace {

using page::Axis;
using page::escaped;
using page::number;
using page::Point;
using page::Svg;

constexpr double kWidth = 520.0;
constexpr double kHeight = 300.0;
constexpr double kLeft = 84.0;
constexpr double kTop = 10.0;
constexpr double kBelow = 52.0;  // ticks and the name of x
constexpr double kRadius = 3.2;
constexpr std::size_t kMostCircles = 300;

struct Range {
  Point low{std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity()};
  Point high{-std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity()};
  bool empty() const { return !(low.x <= high.x) || !(low.y <= high.y); }
};

bool finite(Point p) { return std::isfinite(p.x) && std::isfinite(p.y); }

Range range_of(const std::vector<Series>& series) {
  Range range;
  for (const Series& s : series) {
    for (const Point& p : s.points) {
      if (!finite(p)) continue;
      range.low = {std::min(range.low.x, p.x), std::min(range.low.y, p.y)};
      range.high = {std::max(range.high.x, p.x), std::max(range.high.y, p.y)};
    }
  }
  return range;
}

void widen(double& low, double& high) {
  const double margin = high > low ? 0.06 * (high - low) : std::max(1e-9, 0.1 * std::abs(low));
  low -= margin;
  high += margin;
}

bool is_curve(std::string_view css) { return css.starts_with("curve"); }

void draw(Svg& svg, const Series& s, const Axis& x, const Axis& y) {
  std::vector<Point> places;
  for (const Point& p : s.points) places.push_back({x(p.x), y(p.y)});
  if (is_curve(s.css)) {
    svg.polyline(places, s.css);
    return;
  }
  if (places.size() > kMostCircles) {
    svg.dots(places, fmt::format("cloud {}", s.css.substr(s.css.rfind(' ') + 1)));
    return;
  }
  for (std::size_t i = 0; i < places.size(); ++i) {
    svg.circle(places[i], kRadius, s.css,
               fmt::format("{} {}", number(s.points[i].x), number(s.points[i].y)));
  }
}

/// Grid, numbers and names of the axes about a frame whose corners are the axes' ends.
void draw_axes(Svg& svg, const Caption& caption, const Axis& x, const Axis& y, int x_ticks,
               int y_ticks) {
  const double left = x(x.low());
  const double right = x(x.high());
  const double bottom = std::max(y(y.low()), y(y.high()));
  const double top = std::min(y(y.low()), y(y.high()));
  const auto at = [](const Axis& axis, int count) { return ticks(axis.low(), axis.high(), count); };
  const auto step = [](const std::vector<double>& t) { return t.size() > 1 ? t[1] - t[0] : 1.0; };
  const std::vector<double> across = at(x, x_ticks);
  const std::vector<double> up = at(y, y_ticks);
  for (const double v : up) {
    svg.line({left, y(v)}, {right, y(v)}, "ring");
    svg.text({left - 6.0, y(v) + 4.5}, "end", "tick", tick_label(v, step(up)));
  }
  for (const double v : across) {
    svg.line({x(v), top}, {x(v), bottom}, "ring");
    svg.text({x(v), bottom + 18.0}, "middle", "tick", tick_label(v, step(across)));
  }
  svg.rect({left, top}, right - left, bottom - top, "frame");
  svg.text({0.5 * (left + right), bottom + 42.0}, "middle", "axis", caption.x);
  svg.upward_text({16.0, 0.5 * (top + bottom)}, "axis", caption.y);
}

/// Strength of a value: 0 to 1.
double strength(double value, const MapOptions& options) {
  return std::clamp(std::abs(value - options.middle) / options.full, 0.0, 1.0);
}

std::string_view colour_of(double value, const MapOptions& options) {
  if (options.positive) return "much";
  return value >= options.middle ? "above" : "below";
}

void draw_bar(Svg& svg, const MapOptions& options, double top, double bottom) {
  constexpr int kSteps = 10;
  constexpr double kBar = 444.0;
  const double low = options.positive ? options.middle : options.middle - options.full;
  const Axis y = Axis::linear(low, options.middle + options.full, bottom, top + 20.0);
  for (int i = 0; i < kSteps; ++i) {
    const double span = (options.middle + options.full - low) / kSteps;
    const double v = low + (i + 0.5) * span;
    const double upper = y(low + (i + 1) * span);
    svg.cell({kBar, upper}, 14.0, y(low + i * span) - upper, colour_of(v, options),
             strength(v, options));
  }
  svg.rect({kBar, top + 20.0}, 14.0, bottom - top - 20.0, "frame");
  for (const double v : ticks(low, options.middle + options.full, 5)) {
    svg.text({kBar + 20.0, y(v) + 4.5}, "start", "tick", tick_label(v, options.full / 2.0));
  }
  svg.text({kBar, top + 11.0}, "start", "tick", options.unit);
}

std::string_view colour_name(std::string_view css) {
  const std::string_view last = css.substr(css.rfind(' ') + 1);
  return last == "beyond" ? "bad" : last;
}

std::string key_entry(std::string_view shape, std::string_view colour, std::string_view name) {
  return fmt::format("<span><i class=\"{}\" style=\"color:var(--{})\"></i>{}</span>", shape, colour,
                     escaped(name));
}

}  // namespace

double round_up(double value) {
  if (!(value > 0.0) || !std::isfinite(value)) return 1.0;
  const double power = std::pow(10.0, std::floor(std::log10(value)));
  for (const double factor : {1.0, 2.0, 5.0}) {
    if (value <= factor * power * (1.0 + 1e-9)) return factor * power;
  }
  return 10.0 * power;
}

std::vector<double> ticks(double low, double high, int count) {
  std::vector<double> all;
  if (!(high > low) || !std::isfinite(high - low)) return all;
  const double step = round_up((high - low) / count);
  const double first = std::ceil(low / step - 1e-9);
  for (double k = first; k * step <= high + 1e-9 * step && all.size() < 50; k += 1.0) {
    all.push_back(k * step);
    if (k + 1.0 == k) break;  // so far from zero that steps get lost
  }
  return all;
}

std::string tick_label(double value, double step) {
  const double size = std::max(std::abs(value), std::abs(step));
  if (size >= 1e6 || size < 1e-4) return value == 0.0 ? "0" : number(value);
  const int decimals =
      std::clamp(-static_cast<int>(std::floor(std::log10(std::abs(step)) + 1e-9)), 0, 6);
  const std::string digits = fmt::format("{:.{}f}", std::abs(value), decimals);
  const bool zero = digits.find_first_not_of("0.") == std::string::npos;
  return (value < 0.0 && !zero ? "−" : "") + digits;
}

std::string figure(const Caption& caption, const std::string& drawing,
                   const std::vector<Series>& series, const std::vector<Level>& levels) {
  std::string key;
  for (const Series& s : series) {
    if (s.name.empty() || s.points.empty()) continue;
    key += key_entry(is_curve(s.css)            ? "line"
                     : s.css.starts_with("off") ? "hollow"
                                                : "o",
                     colour_name(s.css), s.name);
  }
  if (!levels.empty() && !levels.front().name.empty()) {
    key += key_entry("d", "bad", levels.front().name);
  }
  if (!key.empty()) key = fmt::format("<div class=\"key\">{}</div>\n", key);
  if (!caption.note.empty())
    key += fmt::format("<p class=\"hint\">{}</p>\n", escaped(caption.note));
  return fmt::format("<figure><figcaption>{}</figcaption>\n{}{}</figure>\n", escaped(caption.title),
                     drawing, key);
}

std::string chart(const Caption& caption, const std::vector<Series>& series,
                  const ChartOptions& options) {
  Range range = range_of(series);
  if (range.empty()) return {};
  if (options.with_zero) {
    range.low.y = std::min(range.low.y, 0.0);
    range.high.y = std::max(range.high.y, 0.0);
  }
  for (const Level& level : options.levels) {
    range.low.y = std::min(range.low.y, level.y);
    range.high.y = std::max(range.high.y, level.y);
  }
  widen(range.low.x, range.high.x);
  widen(range.low.y, range.high.y);
  const Axis x = Axis::linear(range.low.x, range.high.x, kLeft, kWidth - 14.0);
  const Axis y = Axis::linear(range.low.y, range.high.y, kHeight - kBelow, kTop);
  Svg svg(kWidth, kHeight, caption.title);
  draw_axes(svg, caption, x, y, 6, 5);
  if (options.with_zero) svg.line({x(range.low.x), y(0.0)}, {x(range.high.x), y(0.0)}, "mirror");
  for (const Level& level : options.levels) {
    svg.line({x(range.low.x), y(level.y)}, {x(range.high.x), y(level.y)}, "limit");
  }
  for (const Series& s : series) draw(svg, s, x, y);
  return figure(caption, svg.finish(), series, options.levels);
}

std::string scatter(const Caption& caption, const std::vector<Series>& series, double rms,
                    bool downwards) {
  double reach = std::isfinite(rms) ? 1.15 * rms : 0.0;
  bool any = false;
  for (const Series& s : series) {
    if (is_curve(s.css)) continue;
    for (const Point& p : s.points) {
      if (!finite(p)) continue;
      any = true;
      reach = std::max({reach, 1.06 * std::abs(p.x), 1.06 * std::abs(p.y)});
    }
  }
  if (!any) return {};
  if (!(reach > 0.0)) reach = 1.0;
  constexpr double kSide = 340.0;
  constexpr double kX = 110.0;
  const Axis x = Axis::linear(-reach, reach, kX, kX + kSide);
  const Axis y = downwards ? Axis::linear(-reach, reach, kTop, kTop + kSide)
                           : Axis::linear(-reach, reach, kTop + kSide, kTop);
  Svg svg(kWidth, kTop + kSide + kBelow, caption.title);
  draw_axes(svg, caption, x, y, 6, 6);
  svg.line({x(-reach), y(0.0)}, {x(reach), y(0.0)}, "mirror");
  svg.line({x(0.0), y(-reach)}, {x(0.0), y(reach)}, "mirror");
  for (const Series& s : series) draw(svg, s, x, y);
  svg.circle({x(0.0), y(0.0)}, x(rms) - x(0.0), "curve r");
  return figure(caption, svg.finish(), series);
}

std::string field_map(const Caption& caption, const MapOptions& options,
                      const std::vector<Cell>& cells, const std::vector<Series>& series) {
  const double wide = options.high.x - options.low.x;
  const double high = options.high.y - options.low.y;
  if (!(wide > 0.0) || !(high > 0.0)) return {};
  // As large as the plot allows, at one scale for both directions.
  const double scale = std::min(344.0 / wide, 340.0 / high);
  const double bottom = kTop + scale * high;
  const Axis x = Axis::linear(options.low.x, options.high.x, kLeft, kLeft + scale * wide);
  const Axis y = options.downwards ? Axis::linear(options.low.y, options.high.y, kTop, bottom)
                                   : Axis::linear(options.low.y, options.high.y, bottom, kTop);
  Svg svg(kWidth, bottom + kBelow, caption.title);
  for (const Cell& cell : cells) {
    if (!std::isfinite(cell.value)) continue;
    const Point at{std::min(x(cell.low.x), x(cell.high.x)),
                   std::min(y(cell.low.y), y(cell.high.y))};
    const double w = std::abs(x(cell.high.x) - x(cell.low.x));
    const double h = std::abs(y(cell.high.y) - y(cell.low.y));
    svg.cell(at, w, h, colour_of(cell.value, options), strength(cell.value, options));
    if (cell.veiled) svg.rect(at, w, h, "veil");
  }
  draw_axes(svg, caption, x, y, 5, 5);
  for (const Series& s : series) draw(svg, s, x, y);
  if (options.full > 0.0) draw_bar(svg, options, kTop, std::max(bottom, kTop + 120.0));
  return figure(caption, svg.finish(), series);
}

}  // namespace gonio::calibration_report
