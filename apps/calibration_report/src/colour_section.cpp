#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "chart.h"
#include "gonio/render/colour.h"
#include "sections.h"

namespace gonio::calibration_report {
namespace {

using page::Axis;
using page::Svg;

/// "#rrggbb" of a colour as a screen can show it.
std::string screen_colour(const Eigen::Vector3d& linear_srgb) {
  std::string text = "#";
  for (Eigen::Index i = 0; i < 3; ++i) {
    const double value = std::isfinite(linear_srgb[i]) ? std::clamp(linear_srgb[i], 0.0, 1.0) : 0.0;
    text +=
        fmt::format("{:02x}", static_cast<int>(std::lround(255.0 * render::srgb_encode(value))));
  }
  return text;
}

std::string patches(const calibration::ColourMatrix& colour) {
  if (colour.patches.empty()) return {};
  constexpr double kChartLeft = 84.0;
  constexpr double kChartRight = 506.0;
  constexpr double kSwatch = 34.0;
  constexpr double kChartBottom = 268.0;
  const double pitch = (kChartRight - kChartLeft) / static_cast<double>(colour.patches.size());
  const double most = std::max(round_up(colour.max_delta_e), 1e-3);
  const Axis y = Axis::linear(0.0, most, kChartBottom, 10.0 + 2.0 * kSwatch + 14.0);
  Caption caption{"Colour chart: certificate above, found below", "patch", "CIEDE2000",
                  "The bars are how far found is from the certificate; 1 is just seen."};
  Svg svg(520.0, 320.0, caption.title);
  const std::vector<double> marks = ticks(0.0, most, 4);
  for (const double v : marks) {
    svg.line({kChartLeft, y(v)}, {kChartRight, y(v)}, "ring");
    svg.text({kChartLeft - 6.0, y(v) + 4.5}, "end", "tick", tick_label(v, marks.at(1)));
  }
  const std::size_t every = colour.patches.size() / 12 + 1;
  for (std::size_t i = 0; i < colour.patches.size(); ++i) {
    const auto& patch = colour.patches[i];
    const double left = kChartLeft + pitch * static_cast<double>(i);
    svg.swatch({left, 10.0}, pitch, kSwatch, screen_colour(patch.certified));
    svg.swatch({left, 10.0 + kSwatch}, pitch, kSwatch, screen_colour(patch.found));
    svg.rect({left + 0.15 * pitch, y(patch.delta_e)}, 0.7 * pitch, kChartBottom - y(patch.delta_e),
             "bar");
    if (i % every == 0) {
      svg.text({left + 0.5 * pitch, kChartBottom + 18.0}, "middle", "tick",
               fmt::format("{}", i + 1));
    }
  }
  svg.line({kChartLeft, kChartBottom}, {kChartRight, kChartBottom}, "mirror");
  svg.text({0.5 * (kChartLeft + kChartRight), kChartBottom + 42.0}, "middle", "axis", caption.x);
  svg.upward_text({16.0, 0.5 * (y(0.0) + y(most))}, "axis", caption.y);
  return figure(caption, svg.finish(), {});
}

}  // namespace

std::string colour_section(const CalibrationReportData& data) {
  if (!data.findings.colour || data.findings.colour->patches.empty()) return {};
  const auto& colour = *data.findings.colour;
  const Facts facts{{"CIEDE2000", fmt::format("{:.2g} mean, {:.2g} at most", colour.mean_delta_e,
                                              colour.max_delta_e)}};
  return section("Colour", facts, patches(colour));
}

}  // namespace gonio::calibration_report
