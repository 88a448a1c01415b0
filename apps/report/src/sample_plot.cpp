#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <vector>

#include "page_parts.h"
#include "plots.h"

namespace gonio::report {
namespace {

constexpr double kWidth = 1160.0;
constexpr double kLeft = 58.0;
constexpr double kRight = 1150.0;
constexpr double kTop = 26.0;
constexpr double kBottom = 316.0;
constexpr double kResidualTop = 344.0;
constexpr double kResidualBottom = 450.0;
constexpr double kHeight = 482.0;
constexpr double kResidualRange = 4.0;  // sigmas; what lies beyond is drawn at the edge

/// Samples of one pose side by side.
struct Group {
  int pose;
  std::vector<const FittedSample*> members;
};

std::vector<Group> groups_of(const ReportData& data) {
  std::vector<Group> groups;
  std::map<int, std::size_t> at;
  for (const MeasuredPose& pose : data.poses) {
    if (pose.pose < 0 || at.count(pose.pose) != 0) continue;
    at[pose.pose] = groups.size();
    groups.push_back({pose.pose, {}});
  }
  for (const FittedSample& sample : data.samples) {
    const int pose = sample.sample.pose;
    if (pose < 0) {
      groups.push_back({-1, {&sample}});
      continue;
    }
    if (at.count(pose) == 0) {
      at[pose] = groups.size();
      groups.push_back({pose, {}});
    }
    groups[at[pose]].members.push_back(&sample);
  }
  std::erase_if(groups, [](const Group& g) { return g.members.empty(); });
  return groups;
}

double sigma_of(const samples::Sample& s, int c) {
  return std::hypot(s.sigma_per_sr[c], s.u_common_per_sr[c]);
}

/// Whole decades around all that is positive.
std::pair<double, double> range_of(const ReportData& data) {
  double low = 1e30;
  double high = 0.0;
  for (const FittedSample& s : data.samples) {
    for (int c = 0; c < 3; ++c) {
      for (const double v : {s.sample.value_per_sr[c], s.fitted_per_sr[c]}) {
        if (!(v > 0.0) || !std::isfinite(v)) continue;
        low = std::min(low, v);
        high = std::max(high, v);
      }
      const double top = s.sample.value_per_sr[c] + sigma_of(s.sample, c);
      if (std::isfinite(top)) high = std::max(high, top);
    }
  }
  if (!(high > 0.0)) return {1e-3, 1.0};
  low = std::max(low, high * 1e-7);
  low = std::pow(10.0, std::floor(std::log10(low) * 2.0) / 2.0);
  high = std::pow(10.0, std::ceil(std::log10(high * 1.05) * 2.0) / 2.0);
  return {low, std::max(high, low * 10.0)};
}

void draw_frame(Svg& svg, const Axis& y, const Axis& residual) {
  for (const double decade : y.decades()) {
    svg.line({kLeft, y(decade)}, {kRight, y(decade)}, "ring");
    svg.text({kLeft - 6.0, y(decade) + 4.0}, "end", "tick", decade_label(decade));
  }
  svg.rect({kLeft, kTop}, kRight - kLeft, kBottom - kTop, "frame");
  svg.upward_text({13.0, 0.5 * (kTop + kBottom)}, "axis", "BRDF (1/sr)");

  svg.rect({kLeft, residual(2.0)}, kRight - kLeft, residual(-2.0) - residual(2.0), "band2");
  svg.rect({kLeft, residual(1.0)}, kRight - kLeft, residual(-1.0) - residual(1.0), "band1");
  svg.line({kLeft, residual(0.0)}, {kRight, residual(0.0)}, "ring");
  for (const double sigma : {-2.0, 0.0, 2.0}) {
    svg.text({kLeft - 6.0, residual(sigma) + 4.0}, "end", "tick",
             sigma == 0.0 ? std::string("0") : fmt::format("{:+.0f}σ", sigma));
  }
  svg.rect({kLeft, kResidualTop}, kRight - kLeft, kResidualBottom - kResidualTop, "frame");
  svg.upward_text({13.0, 0.5 * (kResidualTop + kResidualBottom)}, "axis", "residual");
}

void draw_sample(Svg& svg, const FittedSample& s, double x, double step, const Axis& y,
                 const Axis& residual) {
  const samples::Sample& sample = s.sample;
  for (int c = 0; c < 3; ++c) {
    const std::string_view channel = kChannelClasses[static_cast<std::size_t>(c)];
    const double at = x + (c - 1) * step * 0.26;
    const double value = sample.value_per_sr[c];
    const double sigma = sigma_of(sample, c);
    const double tick = std::clamp(step * 0.15, 1.2, 7.0);
    if (s.fitted_per_sr[c] >= y.low()) {
      const double fy = y(s.fitted_per_sr[c]);
      svg.line({at - tick, fy}, {at + tick, fy}, fmt::format("fit {}", channel));
    }
    if (value >= y.low()) {
      const double lower = std::max(value - sigma, y.low());
      const double upper = std::min(value + sigma, y.high());
      svg.line({at, y(lower)}, {at, y(upper)}, fmt::format("err {}", channel));
      svg.circle(
          {at, y(value)}, std::clamp(step * 0.11, 1.3, 3.4), fmt::format("dot {}", channel),
          fmt::format("{} ± {} /sr, fit {}; θh {:.2f}°, θd {:.2f}°, φd {:.2f}°", number(value),
                      number(sigma), number(s.fitted_per_sr[c]), sample.direction.theta_h.degrees(),
                      sample.direction.theta_d.degrees(), sample.direction.phi_d.degrees()));
    } else {
      // Dark or negative: a tick that points off the axis.
      svg.polyline({{at - 3.0, kBottom - 6.0}, {at, kBottom - 1.0}, {at + 3.0, kBottom - 6.0}},
                   fmt::format("off {}", channel));
    }
    const double r = s.standardised[c];
    if (std::isfinite(r)) {
      svg.circle({at, residual(std::clamp(r, -kResidualRange, kResidualRange))},
                 std::clamp(step * 0.11, 1.3, 3.0),
                 fmt::format("dot {}{}", channel, std::abs(r) > kResidualRange ? " beyond" : ""));
    }
  }
}

}  // namespace

std::string sample_figure(const ReportData& data) {
  if (data.samples.empty()) return {};
  const std::vector<Group> groups = groups_of(data);
  const auto [low, high] = range_of(data);
  const Axis y = Axis::logarithmic(low, high, kBottom, kTop);
  const Axis residual =
      Axis::linear(-kResidualRange, kResidualRange, kResidualBottom - 4.0, kResidualTop + 4.0);

  Svg svg(kWidth, kHeight, "samples with error bars against the fit, and residuals in sigmas");
  constexpr double kGroupGap = 0.6;  // in samples
  double slots = 0.0;
  for (const Group& g : groups) slots += static_cast<double>(g.members.size()) + kGroupGap;
  const double step = (kRight - kLeft) / slots;

  double left = kLeft;
  for (std::size_t i = 0; i < groups.size(); ++i) {
    const double width = (static_cast<double>(groups[i].members.size()) + kGroupGap) * step;
    if (i % 2 == 1) {
      svg.rect({left, kTop}, width, kBottom - kTop, "stripe");
      svg.rect({left, kResidualTop}, width, kResidualBottom - kResidualTop, "stripe");
    }
    left += width;
  }
  draw_frame(svg, y, residual);

  left = kLeft;
  const std::size_t label_every = groups.size() > 40 ? groups.size() / 20 : 1;
  for (std::size_t i = 0; i < groups.size(); ++i) {
    const double width = (static_cast<double>(groups[i].members.size()) + kGroupGap) * step;
    for (std::size_t k = 0; k < groups[i].members.size(); ++k) {
      const double x = left + (static_cast<double>(k) + 0.5 + 0.5 * kGroupGap) * step;
      draw_sample(svg, *groups[i].members[k], x, step, y, residual);
    }
    if (i % label_every == 0) {
      svg.text({left + 0.5 * width, kResidualBottom + 15.0}, "middle", "tick",
               fmt::format("{}", data.poses.empty() ? static_cast<int>(i) + 1 : groups[i].pose));
    }
    left += width;
  }
  svg.text({0.5 * (kLeft + kRight), kHeight - 3.0}, "middle", "axis",
           data.poses.empty() ? "sample" : "point, in visiting order");
  return fmt::format("<div class=\"wide\">{}</div>\n", svg.finish());
}

}  // namespace gonio::report
