#include "gonio/page/svg.h"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <stdexcept>

#include "gonio/page/html.h"

namespace gonio::page {
namespace {

bool finite(Point p) { return std::isfinite(p.x) && std::isfinite(p.y); }

/// One decimal is a tenth of a pixel; "-0.0" and "3.0" would only make the page longer.
std::string coordinate(double value) {
  const double rounded = std::round(value * 10.0) / 10.0;
  return fmt::format("{:g}", rounded == 0.0 ? 0.0 : rounded);
}

}  // namespace

Svg::Svg(double width, double height, std::string_view label)
    : body_(fmt::format("<svg viewBox=\"0 0 {} {}\" role=\"img\" aria-label=\"{}\">\n", width,
                        height, escaped(label))) {}

void Svg::line(Point from, Point to, std::string_view css) {
  if (!finite(from) || !finite(to)) return;
  body_ +=
      fmt::format("<line x1=\"{}\" y1=\"{}\" x2=\"{}\" y2=\"{}\" class=\"{}\"/>\n",
                  coordinate(from.x), coordinate(from.y), coordinate(to.x), coordinate(to.y), css);
}

void Svg::polyline(const std::vector<Point>& points, std::string_view css) {
  std::string path;
  bool pen_down = false;
  for (const Point& p : points) {
    if (!finite(p)) {
      pen_down = false;
      continue;
    }
    path += fmt::format("{}{} {}", pen_down ? "L" : "M", coordinate(p.x), coordinate(p.y));
    pen_down = true;
  }
  if (path.empty()) return;
  body_ += fmt::format("<path d=\"{}\" class=\"{}\"/>\n", path, css);
}

void Svg::circle(Point centre, double radius, std::string_view css, std::string_view tooltip) {
  if (!finite(centre) || !std::isfinite(radius)) return;
  body_ += fmt::format("<circle cx=\"{}\" cy=\"{}\" r=\"{}\" class=\"{}\"", coordinate(centre.x),
                       coordinate(centre.y), coordinate(radius), css);
  body_ +=
      tooltip.empty() ? "/>\n" : fmt::format("><title>{}</title></circle>\n", escaped(tooltip));
}

void Svg::rect(Point top_left, double width, double height, std::string_view css) {
  if (!finite(top_left) || !std::isfinite(width) || !std::isfinite(height)) return;
  body_ += fmt::format("<rect x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" class=\"{}\"/>\n",
                       coordinate(top_left.x), coordinate(top_left.y), coordinate(width),
                       coordinate(height), css);
}

void Svg::cell(Point top_left, double width, double height, std::string_view css, double opacity) {
  if (!finite(top_left) || !std::isfinite(width) || !std::isfinite(height)) return;
  if (!std::isfinite(opacity)) return;
  body_ += fmt::format(
      "<rect x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" class=\"{}\" opacity=\"{:.3g}\"/>\n",
      coordinate(top_left.x), coordinate(top_left.y), coordinate(width), coordinate(height), css,
      opacity);
}

void Svg::swatch(Point top_left, double width, double height, std::string_view colour) {
  if (!finite(top_left) || !std::isfinite(width) || !std::isfinite(height)) return;
  body_ += fmt::format("<rect x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" fill=\"{}\"/>\n",
                       coordinate(top_left.x), coordinate(top_left.y), coordinate(width),
                       coordinate(height), colour);
}

void Svg::dots(const std::vector<Point>& points, std::string_view css) {
  std::string path;
  for (const Point& p : points) {
    if (finite(p)) path += fmt::format("M{} {}h0", coordinate(p.x), coordinate(p.y));
  }
  if (!path.empty()) body_ += fmt::format("<path d=\"{}\" class=\"{}\"/>\n", path, css);
}

void Svg::text(Point at, std::string_view anchor, std::string_view css, std::string_view text) {
  if (!finite(at)) return;
  body_ += fmt::format("<text x=\"{}\" y=\"{}\" text-anchor=\"{}\" class=\"{}\">{}</text>\n",
                       coordinate(at.x), coordinate(at.y), anchor, css, escaped(text));
}

void Svg::upward_text(Point at, std::string_view css, std::string_view text) {
  if (!finite(at)) return;
  body_ += fmt::format(
      "<text transform=\"translate({} {}) rotate(-90)\" text-anchor=\"middle\" "
      "class=\"{}\">{}</text>\n",
      coordinate(at.x), coordinate(at.y), css, escaped(text));
}

std::string Svg::finish() const { return body_ + "</svg>\n"; }

Axis::Axis(double low, double high, double at_low, double at_high, bool logarithmic)
    : low_(low), high_(high), at_low_(at_low), at_high_(at_high), logarithmic_(logarithmic) {}

Axis Axis::linear(double low, double high, double at_low, double at_high) {
  return Axis(low, high, at_low, at_high, false);
}

Axis Axis::logarithmic(double low, double high, double at_low, double at_high) {
  if (!(low > 0.0) || !(high > low)) throw std::invalid_argument("logarithmic axis: empty range");
  return Axis(low, high, at_low, at_high, true);
}

double Axis::operator()(double value) const {
  const double share = logarithmic_ ? std::log(value / low_) / std::log(high_ / low_)
                                    : (value - low_) / (high_ - low_);
  return at_low_ + share * (at_high_ - at_low_);
}

std::vector<double> Axis::decades() const {
  std::vector<double> powers;
  constexpr double kRounding = 1e-9;
  for (int n = static_cast<int>(std::ceil(std::log10(low_) - kRounding));
       n <= static_cast<int>(std::floor(std::log10(high_) + kRounding)); ++n) {
    powers.push_back(std::pow(10.0, n));
  }
  return powers;
}

std::string decade_label(double power_of_ten) {
  const int n = static_cast<int>(std::lround(std::log10(power_of_ten)));
  if (n >= 0 && n <= 4) return fmt::format("{:.0f}", power_of_ten);
  if (n < 0 && n >= -3) return fmt::format("{:.{}f}", power_of_ten, -n);
  constexpr std::array<std::string_view, 10> kSuperscripts = {"⁰", "¹", "²", "³", "⁴",
                                                              "⁵", "⁶", "⁷", "⁸", "⁹"};
  std::string label = n < 0 ? "10⁻" : "10";
  for (const char digit : std::to_string(std::abs(n))) {
    label += kSuperscripts[static_cast<std::size_t>(digit - '0')];
  }
  return label;
}

}  // namespace gonio::page
