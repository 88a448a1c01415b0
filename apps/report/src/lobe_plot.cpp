#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <vector>

#include "gonio/brdf/brdf_table.h"
#include "page_parts.h"
#include "plots.h"

namespace gonio::report {
namespace {

using namespace literals;

constexpr std::array<double, 4> kThetaIDeg = {15.0, 35.0, 55.0, 72.0};
constexpr double kLastDeg = 86.0;  // beyond, the last cells before the horizon end the curve

/// BRDF along the plane of incidence; positive theta_o is the mirror side.
struct Lobe {
  std::vector<double> theta_o_deg;
  std::vector<brdf::Rgb> value;
};

Lobe lobe_of(const brdf::BrdfModel& model, double theta_i_deg) {
  Lobe lobe;
  const Eigen::Vector3d wi = brdf::direction(Angle::from_degrees(theta_i_deg), 180.0_deg);
  double theta = -kLastDeg;
  while (theta <= kLastDeg + 1e-9) {
    const Eigen::Vector3d wo =
        brdf::direction(Angle::from_degrees(std::abs(theta)), theta >= 0.0 ? 0.0_deg : 180.0_deg);
    lobe.theta_o_deg.push_back(theta);
    lobe.value.push_back(model.evaluate(brdf::DirectionPair{wi, wo}));
    const double from_mirror = std::abs(theta - theta_i_deg);
    theta += from_mirror < 4.0 ? 0.1 : (from_mirror < 20.0 ? 0.5 : 1.0);
  }
  return lobe;
}

struct Range {
  double low;
  double high;
};

/// Half decades around what is shown, at most five decades.
Range range_of(const std::vector<const Lobe*>& lobes) {
  double low = 1e30;
  double high = 0.0;
  for (const Lobe* lobe : lobes) {
    for (const brdf::Rgb& value : lobe->value) {
      for (const double v : value) {
        if (!(v > 0.0)) continue;
        low = std::min(low, v);
        high = std::max(high, v);
      }
    }
  }
  if (!(high > 0.0)) return {1e-3, 1.0};
  low = std::max(low, high * 1e-5);
  low = std::pow(10.0, std::floor(std::log10(low) * 2.0) / 2.0);
  high = std::pow(10.0, std::ceil(std::log10(high * 1.1) * 2.0) / 2.0);
  return {low, std::max(high, low * 10.0)};
}

/// Where the true curve is expected.
struct Band {
  Lobe lower;
  Lobe upper;
};

std::string cartesian(double theta_i_deg, const Lobe* truth, const Lobe& fit, const Band* band) {
  constexpr double kWidth = 560.0;
  constexpr double kHeight = 300.0;
  constexpr double kLeft = 52.0;
  constexpr double kRight = 550.0;
  constexpr double kTop = 26.0;
  constexpr double kBottom = 256.0;
  std::vector<const Lobe*> both = {&fit};
  if (truth != nullptr) both.push_back(truth);
  const Range range = range_of(both);
  const Axis x = Axis::linear(-90.0, 90.0, kLeft, kRight);
  const Axis y = Axis::logarithmic(range.low, range.high, kBottom, kTop);

  Svg svg(kWidth, kHeight,
          fmt::format("BRDF in the plane of incidence at {} degrees", theta_i_deg));
  for (const double decade : y.decades()) {
    svg.line({kLeft, y(decade)}, {kRight, y(decade)}, "ring");
    svg.text({kLeft - 6.0, y(decade) + 4.0}, "end", "tick", decade_label(decade));
  }
  for (int deg = -90; deg <= 90; deg += 30) {
    svg.line({x(deg), kTop}, {x(deg), kBottom}, "ring");
    svg.text({x(deg), kBottom + 16.0}, "middle", "tick",
             deg < 0 ? fmt::format("−{}°", -deg) : fmt::format("{}°", deg));
  }
  svg.line({x(theta_i_deg), kTop}, {x(theta_i_deg), kBottom}, "mirror");
  svg.rect({kLeft, kTop}, kRight - kLeft, kBottom - kTop, "frame");
  svg.text({kLeft, 16.0}, "start", "plottitle", fmt::format("θi = {:.0f}°", theta_i_deg));
  svg.text({0.5 * (kLeft + kRight), kHeight - 8.0}, "middle", "axis",
           "θo, mirror side positive; BRDF in 1/sr");

  const auto draw = [&](const Lobe& lobe, std::string_view css) {
    for (int c = 0; c < 3; ++c) {
      std::vector<Point> points;
      for (std::size_t i = 0; i < lobe.value.size(); ++i) {
        const double v = std::max(lobe.value[i][c], range.low);
        points.push_back({x(lobe.theta_o_deg[i]), y(v)});
      }
      svg.polyline(points, fmt::format("{} {}", css, kChannelClasses[static_cast<std::size_t>(c)]));
    }
  };
  if (band != nullptr) {
    // Up along one limit, back along the other; cut off at the frame.
    const auto at = [&](const Lobe& lobe, std::size_t i, int c) {
      return Point{x(lobe.theta_o_deg[i]), y(std::clamp(lobe.value[i][c], range.low, range.high))};
    };
    const std::size_t count = band->upper.value.size();
    for (int c = 0; c < 3; ++c) {
      std::vector<Point> outline;
      for (std::size_t i = 0; i < count; ++i) outline.push_back(at(band->upper, i, c));
      for (std::size_t i = count; i-- > 0;) outline.push_back(at(band->lower, i, c));
      svg.polyline(outline, fmt::format("band {}", kChannelClasses[static_cast<std::size_t>(c)]));
    }
  }
  if (truth != nullptr) draw(*truth, "curve truth");
  draw(fit, "curve");
  return svg.finish();
}

double luminance(const brdf::Rgb& v) { return 0.2126 * v[0] + 0.7152 * v[1] + 0.0722 * v[2]; }

/// All angles of incidence in one half circle; outwards is the logarithm of the luminance.
std::string polar(const std::vector<Lobe>& truths, const std::vector<Lobe>& fits) {
  constexpr double kWidth = 780.0;
  constexpr double kHeight = 420.0;
  constexpr Point kCentre = {400.0, 384.0};
  constexpr double kRadius = 346.0;
  std::vector<const Lobe*> all;
  for (const Lobe& lobe : fits) all.push_back(&lobe);
  for (const Lobe& lobe : truths) all.push_back(&lobe);
  const Range range = range_of(all);
  const Axis r = Axis::logarithmic(range.low, range.high, 0.0, kRadius);
  const auto at = [&](double theta_deg, double radius) {
    const double theta = Angle::from_degrees(theta_deg).radians();
    return Point{kCentre.x + radius * std::sin(theta), kCentre.y - radius * std::cos(theta)};
  };

  Svg svg(kWidth, kHeight, "luminance of the BRDF in the plane of incidence, polar");
  for (const double decade : r.decades()) {
    std::vector<Point> arc;
    for (int deg = -90; deg <= 90; deg += 3) arc.push_back(at(deg, r(decade)));
    svg.polyline(arc, "arc");
    svg.text({kCentre.x + r(decade), kCentre.y + 15.0}, "middle", "tick", decade_label(decade));
  }
  for (int deg = -90; deg <= 90; deg += 15) {
    svg.line(kCentre, at(deg, kRadius), "ring");
    if (deg % 30 == 0) {
      svg.text(at(deg, kRadius + 14.0), "middle", "tick",
               deg < 0 ? fmt::format("−{}°", -deg) : fmt::format("{}°", deg));
    }
  }
  const auto draw = [&](const Lobe& lobe, std::string_view css) {
    std::vector<Point> points;
    for (std::size_t i = 0; i < lobe.value.size(); ++i) {
      const double v = std::max(luminance(lobe.value[i]), range.low);
      points.push_back(at(lobe.theta_o_deg[i], r(v)));
    }
    svg.polyline(points, css);
  };
  for (std::size_t i = 0; i < fits.size(); ++i) {
    if (i < truths.size()) draw(truths[i], fmt::format("curve truth p{}", i));
    draw(fits[i], fmt::format("curve p{}", i));
    const double y = 30.0 + 22.0 * static_cast<double>(i);
    svg.line({8.0, y - 4.0}, {34.0, y - 4.0}, fmt::format("curve p{}", i));
    svg.text({42.0, y}, "start", "tick", fmt::format("θi = {:.0f}°", kThetaIDeg[i]));
  }
  return svg.finish();
}

}  // namespace

std::string lobe_figures(const ReportData& data) {
  const brdf::TableBrdf fit(*data.methods.front().table);
  std::optional<brdf::TableBrdf> truth;
  if (data.truth) truth.emplace(*data.truth);

  const MethodResult& method = data.methods.front();
  std::optional<brdf::TableBrdf> lower;
  std::optional<brdf::TableBrdf> upper;
  if (method.lower_95 && method.upper_95) {
    lower.emplace(*method.lower_95);
    upper.emplace(*method.upper_95);
  }

  std::vector<Lobe> fits;
  std::vector<Lobe> truths;
  std::vector<Band> bands;
  std::string grid;
  for (const double theta_i : kThetaIDeg) {
    fits.push_back(lobe_of(fit, theta_i));
    if (truth) truths.push_back(lobe_of(*truth, theta_i));
    if (lower) bands.push_back({lobe_of(*lower, theta_i), lobe_of(*upper, theta_i)});
  }
  for (std::size_t i = 0; i < fits.size(); ++i) {
    grid +=
        fmt::format("<figure>{}</figure>\n", cartesian(kThetaIDeg[i], truth ? &truths[i] : nullptr,
                                                       fits[i], lower ? &bands[i] : nullptr));
  }
  return fmt::format("<div class=\"duo\">\n{}</div>\n<div class=\"polar\">{}</div>\n", grid,
                     polar(truths, fits));
}

}  // namespace gonio::report
