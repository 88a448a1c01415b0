#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "chart.h"
#include "sections.h"

namespace gonio::calibration_report {
namespace {

std::string lamp_arm(const CalibrationReportData& data, Facts& facts) {
  if (!data.findings.lamp_arm) return {};
  const auto& arm = *data.findings.lamp_arm;
  facts.emplace_back("Lamp arm", fmt::format("{:.3g} px rms", arm.rms_px));
  const auto* seen = seen_by(data, "lamp_arm");
  Series one{{}, "dot g", "mirror as mounted"};
  Series turned{{}, "dot b", "turned by half a turn"};
  Series across{{}, "dot g", "across"};
  Series down{{}, "off b", "down"};
  for (std::size_t i = 0; i < arm.residual_px.size(); ++i) {
    const Eigen::Vector2d& off = arm.residual_px[i];
    const auto* view = seen != nullptr && i < seen->mirrors.size() ? &seen->mirrors[i] : nullptr;
    (view != nullptr && view->turned ? turned : one).points.push_back({off.x(), off.y()});
    if (view == nullptr || arm.rig.lamp.links.empty()) continue;
    const std::size_t axis = arm.rig.lamp.links.front().axis;
    if (axis >= view->joints.size()) continue;
    across.points.push_back({view->joints[axis].degrees(), off.x()});
    down.points.push_back({view->joints[axis].degrees(), off.y()});
  }
  Series circle{{{0.0, 0.0}}, "curve r", fmt::format("rms {:.3g} px", arm.rms_px)};
  return scatter({"Lamp in the mirror", "dx, to the right (px)", "dy, down (px)",
                  "A line or an arc is something that the model does not know."},
                 {one, turned, circle}, arm.rms_px) +
         chart({"Axis fit: lamp arm", "lamp arm (deg)", "image off the model (px)",
                "Residuals that go with the angle are something the model does not know."},
               {across, down}, {.with_zero = true});
}

std::string mirror_peaks(const CalibrationReportData& data, Facts& facts) {
  if (!data.findings.zeros) return {};
  const auto& zeros = *data.findings.zeros;
  facts.emplace_back("Azimuth: mirror less board",
                     with_sigma({zeros.azimuth.degrees(),
                                 1e-3 * kMilliDegrees * std::sqrt(zeros.covariance(0, 0))},
                                "deg"));
  facts.emplace_back(
      "Tilt: mirror less board",
      with_sigma({zeros.tilt.degrees(), 1e-3 * kMilliDegrees * std::sqrt(zeros.covariance(1, 1))},
                 "deg"));
  Series one{{}, "dot g", "mirror as mounted"};
  Series turned{{}, "dot b", "turned by half a turn"};
  double squares = 0.0;
  for (std::size_t i = 0; i < zeros.residuals.size(); ++i) {
    const Eigen::Vector2d off = kMilliDegrees * zeros.residuals[i];
    const bool is_turned = i < data.findings.peaks.size() && data.findings.peaks[i].turned;
    (is_turned ? turned : one).points.push_back({off.x(), off.y()});
    squares += off.squaredNorm();
  }
  const double rms =
      std::sqrt(squares / static_cast<double>(std::max<std::size_t>(1, zeros.residuals.size())));
  Series circle{{{0.0, 0.0}}, "curve r", fmt::format("rms {:.2g} mdeg", rms)};
  return scatter({"Mirror peaks: what is left", "slope along x (mdeg)", "slope along y (mdeg)",
                  "The sigmas are of this look alone; the zeros in the archive have a homing's "
                  "scatter as well. A line or an arc is something left unexplained."},
                 {one, turned, circle}, rms, false);
}

/// The scans themselves: brightness over azimuth and tilt about the peak.
std::string scans(const CalibrationReportData& data) {
  const auto* seen = seen_by(data, "zero_offsets");
  if (seen == nullptr || !data.findings.lamp_arm) return {};
  const auto& rig = data.findings.lamp_arm->rig;
  if (rig.sample.links.size() < 2 || rig.lamp.links.empty()) return {};
  const std::size_t azimuth = rig.sample.links[0].axis;
  const std::size_t lamp = rig.lamp.links[0].axis;
  std::vector<Series> series;
  constexpr const char* kColours[] = {"dot g", "dot b", "dot r", "off g", "off b", "off r"};
  for (std::size_t i = 0; i < seen->scans.size() && i < std::size(kColours); ++i) {
    const auto& scan = seen->scans[i];
    if (scan.samples.empty() || i >= data.findings.peaks.size()) continue;
    const rig::Joints& peak = data.findings.peaks[i].joints;
    double brightest = 0.0;
    for (const auto& s : scan.samples) brightest = std::max(brightest, s.signal);
    if (!(brightest > 0.0)) continue;
    Series points{{}, kColours[i], ""};
    for (const auto& s : scan.samples) {
      if (azimuth >= s.joints.size() || azimuth >= peak.size() || lamp >= s.joints.size()) continue;
      points.points.push_back(
          {(s.joints[azimuth] - peak[azimuth]).degrees(), s.signal / brightest});
      points.name = fmt::format("arm at {:.0f} deg{}", s.joints[lamp].degrees(),
                                scan.turned ? ", turned" : "");
    }
    series.push_back(std::move(points));
  }
  return chart(
      {"Mirror peaks: the scans", "azimuth off the peak found (deg)", "signal of the brightest",
       "Each column of points is one azimuth at seven tilts; its top should be highest at "
       "zero."},
      series, {.with_zero = true});
}

}  // namespace

std::string lamp_geometry_section(const CalibrationReportData& data) {
  Facts facts;
  std::string figures = lamp_arm(data, facts);
  figures += mirror_peaks(data, facts);
  figures += scans(data);
  return section("Lamp arm and zeros", facts, figures);
}

}  // namespace gonio::calibration_report
