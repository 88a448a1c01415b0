#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "chart.h"
#include "gonio/calibration/sensor/darks.h"
#include "sections.h"

namespace gonio::calibration_report {
namespace {

using page::Point;

/// Two sigmas of a level's variance, relative: the same for all levels of one region.
double two_sigma_percent(const CalibrationReportData& data) {
  const auto* seen = seen_by(data, "photon_transfer");
  if (seen == nullptr) return 0.0;
  std::vector<double> relative;
  for (const auto& level : seen->levels) {
    if (level.variance_dn2.value > 0.0) {
      relative.push_back(level.variance_dn2.sigma / level.variance_dn2.value);
    }
  }
  if (relative.empty()) return 0.0;
  const auto middle = relative.begin() + static_cast<std::ptrdiff_t>(relative.size() / 2);
  std::nth_element(relative.begin(), middle, relative.end());
  return 200.0 * *middle;
}

std::string photon_transfer(const CalibrationReportData& data, Facts& facts) {
  if (!data.findings.photon_transfer) return {};
  const auto& ptc = *data.findings.photon_transfer;
  Series used{{}, "dot g", "in the fit"};
  Series left_out{{}, "off b", "left out"};
  Series fit{{}, "curve r", "fit"};
  Series used_residuals{{}, "dot g", "in the fit"};
  for (const auto& p : ptc.points) {
    (p.used ? used : left_out).points.push_back({p.signal_dn, p.variance_dn2});
    if (!p.used) continue;
    fit.points.push_back({p.signal_dn, p.fitted_dn2});
    if (p.fitted_dn2 > 0.0) {
      used_residuals.points.push_back({p.signal_dn, 100.0 * (p.variance_dn2 / p.fitted_dn2 - 1.0)});
    }
  }
  facts.emplace_back("Gain", with_sigma(ptc.gain_dn_per_e, "DN/e"));
  facts.emplace_back("Read noise", with_sigma(ptc.read_noise_e, "e") +
                                       (ptc.read_noise_is_bound ? " (upper bound)" : ""));
  ChartOptions options{.with_zero = true};
  if (const double limit = two_sigma_percent(data); limit > 0.0) {
    options.levels = {{limit, "two sigmas"}, {-limit, ""}};
  }
  return chart({"Photon transfer", "signal (DN)", "variance (DN²)",
                "Points off the line below the blue rings are a response that bends or a lamp that "
                "flickers."},
               {fit, left_out, used}) +
         chart({"Photon transfer: residuals", "signal (DN)", "variance off the fit (%)",
                "A bow says that the response bends, or that frames are not raw."},
               {used_residuals}, options);
}

std::string linearity(const CalibrationReportData& data, Facts& facts) {
  if (!data.findings.linearity) return {};
  Series before{{}, "off r", "off the line"};
  Series after{{}, "dot g", "after the curve"};
  for (const auto& p : data.findings.linearity->points) {
    if (!p.in_range) continue;
    before.points.push_back({p.signal_dn, p.deviation_percent});
    after.points.push_back({p.signal_dn, p.after_curve_percent});
  }
  facts.emplace_back("Linearity error", fmt::format("{:.3g} %, after the curve {:.2g} %",
                                                    data.findings.linearity->le_percent,
                                                    data.findings.linearity->after_curve_percent));
  return chart({"Linearity", "signal (DN)", "deviation (%)",
                "Dots that still make a bow are a lamp that drifted."},
               {before, after}, {.with_zero = true});
}

/// How many bad pixels lie in each field of a grid: beyond some thousands marks only cover another.
std::vector<Cell> density(const std::vector<std::uint8_t>& mask, int width, int height,
                          double& fullest) {
  constexpr int kFields = 32;
  const int side = std::max(1, (std::max(width, height) + kFields - 1) / kFields);
  const int across = (width + side - 1) / side;
  const int down = (height + side - 1) / side;
  std::vector<double> count(static_cast<std::size_t>(across) * static_cast<std::size_t>(down));
  for (std::size_t i = 0; i < mask.size(); ++i) {
    if (mask[i] == 0) continue;
    const auto column = i % static_cast<std::size_t>(width) / static_cast<std::size_t>(side);
    const auto row = i / static_cast<std::size_t>(width) / static_cast<std::size_t>(side);
    count[row * static_cast<std::size_t>(across) + column] += 1.0;
  }
  fullest = *std::max_element(count.begin(), count.end());
  std::vector<Cell> cells;
  for (int row = 0; row < down; ++row) {
    for (int column = 0; column < across; ++column) {
      const double n = count[static_cast<std::size_t>(row * across + column)];
      if (n == 0.0) continue;
      cells.push_back(
          {{column * side - 0.5, row * side - 0.5},
           {std::min((column + 1) * side, width) - 0.5, std::min((row + 1) * side, height) - 0.5},
           n});
    }
  }
  return cells;
}

std::string bad_pixels(const CalibrationReportData& data, Facts& facts) {
  namespace defect = calibration::sensor::defect;
  const auto& mask = data.findings.bad_pixels;
  const int width = data.instrument.camera.width_px;
  const int height = data.instrument.camera.height_px;
  if (width < 1 || height < 1 ||
      mask.size() != static_cast<std::size_t>(width) * static_cast<std::size_t>(height)) {
    return {};
  }
  std::array<Series, 3> kinds{Series{{}, "dot r", "hot"}, Series{{}, "dot b", "cold"},
                              Series{{}, "dot light", "blinking"}};
  std::size_t all = 0;
  for (std::size_t i = 0; i < mask.size(); ++i) {
    if (mask[i] == 0) continue;
    ++all;
    const std::size_t kind = (mask[i] & defect::kHot) != 0    ? 0
                             : (mask[i] & defect::kCold) != 0 ? 1
                                                              : 2;
    kinds[kind].points.push_back({static_cast<double>(i % static_cast<std::size_t>(width)),
                                  static_cast<double>(i / static_cast<std::size_t>(width))});
  }
  facts.emplace_back(
      "Bad pixels",
      fmt::format("{} of {} ({:.2g} %): {} hot, {} cold, {} only blinking", all, mask.size(),
                  100.0 * static_cast<double>(all) / static_cast<double>(mask.size()),
                  kinds[0].points.size(), kinds[1].points.size(), kinds[2].points.size()));
  MapOptions options;
  options.low = {-0.5, -0.5};
  options.high = {width - 0.5, height - 0.5};
  Caption caption{"Bad pixels in the frame", "column (px)", "row (px)",
                  "Spread evenly where all is well; a row, a column or a heap is a fault."};
  constexpr std::size_t kMostMarks = 3000;
  if (all <= kMostMarks) {
    return field_map(caption, options, {}, {kinds.begin(), kinds.end()});
  }
  double fullest = 1.0;
  const std::vector<Cell> cells = density(mask, width, height, fullest);
  options.positive = true;
  options.full = round_up(fullest);
  options.unit = "pixels";
  return field_map(caption, options, cells, {});
}

}  // namespace

std::string sensor_section(const CalibrationReportData& data) {
  Facts facts;
  std::string figures = photon_transfer(data, facts);
  figures += linearity(data, facts);
  if (data.findings.darks) {
    const auto& darks = *data.findings.darks;
    facts.emplace_back("Black level", with_sigma(darks.black_level_dn, "DN"));
    facts.emplace_back("Dark current", with_sigma(darks.dark_current_dn_per_s, "DN/s"));
  }
  figures += bad_pixels(data, facts);
  return section("Sensor", facts, figures);
}

}  // namespace gonio::calibration_report
