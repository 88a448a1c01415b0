#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>

#include "chart.h"
#include "sections.h"
#include "white_residuals.h"

namespace gonio::calibration_report {
namespace {

using page::Point;

double tangent_of_degrees(double degrees) { return std::tan(degrees * std::numbers::pi / 180.0); }

std::string warm_up(const CalibrationReportData& data, Facts& facts) {
  if (!data.findings.lamp) return {};
  const auto& lamp = *data.findings.lamp;
  facts.emplace_back(
      "Lamp", fmt::format("warm after {:.1f} min, drift {:.2g} % in 10 min",
                          lamp.warm_after_s.value / 60.0, 100.0 * lamp.drift_per_10_min.value));
  const auto* seen = seen_by(data, "warm_up");
  if (seen == nullptr || !(lamp.level.value > 0.0)) return {};
  Series readings{{}, "dot g", "readings"};
  Series fit{{}, "curve r", "fit"};
  for (const auto& r : seen->lamp) {
    const double rest =
        lamp.already_warm ? 0.0 : lamp.amplitude.value * std::exp(-r.time_s / lamp.tau_s.value);
    readings.points.push_back({r.time_s / 60.0, 100.0 * (r.value / lamp.level.value - 1.0)});
    fit.points.push_back({r.time_s / 60.0, -100.0 * rest});
  }
  return chart(
      {"Warm-up and drift", "time (min)", "off the warm level (%)",
       "Warm: from then on it drifts by less than 0.2 % in 10 min. Readings that leave the "
       "curve at its end are a lamp that wanders."},
      {fit, readings}, {.with_zero = true});
}

double intensity(const instrument::LampField& f, Point degrees) {
  const double x = tangent_of_degrees(degrees.x);
  const double y = tangent_of_degrees(degrees.y);
  return 1.0 + f.c10 * x + f.c01 * y + f.c20 * x * x + f.c11 * x * y + f.c02 * y * y;
}

/// Intensity over the lamp's field, faded where no view has looked.
std::string lamp_field(const instrument::LampField& field,
                       const std::vector<WhiteResidual>& residuals) {
  std::vector<Point> looked_at;
  double reach = 0.0;
  for (const WhiteResidual& r : residuals) {
    looked_at.push_back(r.off_lamp_axis);
    reach = std::max({reach, std::abs(r.off_lamp_axis.x), std::abs(r.off_lamp_axis.y)});
  }
  const std::vector<Point> hull = convex_hull(looked_at);
  if (hull.empty()) return {};
  reach *= 1.25;
  constexpr int kFields = 25;
  std::vector<Cell> cells;
  double most = 0.0;
  for (int i = 0; i < kFields * kFields; ++i) {
    const double side = 2.0 * reach / kFields;
    const Point low{-reach + side * (i % kFields), -reach + side * (i / kFields)};
    const Point middle{low.x + 0.5 * side, low.y + 0.5 * side};
    const double percent = 100.0 * intensity(field, middle);
    const bool known = inside(hull, middle);
    if (known) most = std::max(most, std::abs(percent - 100.0));
    cells.push_back({low, {low.x + side, low.y + side}, percent, !known});
  }
  MapOptions options;
  options.low = {-reach, -reach};
  options.high = {reach, reach};
  options.downwards = false;
  options.middle = 100.0;
  options.full = round_up(most);
  options.unit = "%";
  return field_map(
      {"Lamp field: intensity, that on the axis 100 %", "off the lamp's axis, x (deg)", "y (deg)",
       "Faded: outside what the views covered, where nothing supports the curve."},
      options, cells, {{hull, "curve g", "covered by the views"}});
}

/// Mean residual of all poses and colours by place in the picture.
std::string flat_field(const CalibrationReportData& data,
                       const std::vector<WhiteResidual>& residuals) {
  const int width = data.instrument.camera.width_px;
  const int height = data.instrument.camera.height_px;
  if (residuals.empty() || width < 1 || height < 1) return {};
  constexpr int kAcross = 24;
  const double side = static_cast<double>(width) / kAcross;
  std::map<std::pair<int, int>, std::pair<double, int>> fields;
  for (const WhiteResidual& r : residuals) {
    auto& [sum, count] = fields[{static_cast<int>(std::floor((r.column + 0.5) / side)),
                                 static_cast<int>(std::floor((r.row + 0.5) / side))}];
    sum += r.percent;
    ++count;
  }
  std::vector<Cell> cells;
  for (const auto& [field, mean] : fields) {
    const Point low{field.first * side - 0.5, field.second * side - 0.5};
    cells.push_back({low, {low.x + side, low.y + side}, mean.first / mean.second});
  }
  MapOptions options;
  options.low = {-0.5, -0.5};
  options.high = {width - 0.5, height - 0.5};
  options.full = 0.5;  // what the step lets pass
  options.unit = "%";
  return field_map({"Flat field: seen less fitted over the picture", "column (px)", "row (px)",
                    fmt::format("Mean of {} readings of the white; full colour is where the step "
                                "refuses. A pattern is light that the fields do not know.",
                                residuals.size())},
                   options, cells, {});
}

/// Largest tangent of the field angle at which the white was seen.
double seen_to(const instrument::CameraModel& camera, const std::vector<WhiteResidual>& residuals) {
  double most = 0.0;
  for (const WhiteResidual& residual : residuals) {
    const Eigen::Vector3d ray = camera.ray(residual.column, residual.row);
    most = std::max(most, ray.head<2>().norm() / ray.z());
  }
  return most;
}

std::string falloff(const CalibrationReportData& data,
                    const std::vector<WhiteResidual>& residuals) {
  const auto& camera = data.instrument.camera;
  const auto& v = data.findings.fields->vignetting;
  if (!(camera.fx_px > 0.0)) return {};
  const double corner =
      0.5 * std::hypot(camera.width_px, camera.height_px) / camera.fx_px;  // tangent
  const double covered = seen_to(camera, residuals);
  Series curve{{}, "curve r", "where the white was seen"};
  Series beyond{{}, "curve b", "beyond: nothing supports it"};
  constexpr int kPoints = 40;
  for (int i = 0; i <= kPoints; ++i) {
    const double t = corner * i / kPoints;
    const double q = t * t;
    const Point point{std::atan(t) * 180.0 / std::numbers::pi,
                      100.0 * (1.0 + q * (v.v1 + q * (v.v2 + q * v.v3)))};
    if (t <= covered) {
      curve.points.push_back(point);
      beyond.points.assign(1, point);  // it begins where the other ends
    } else {
      beyond.points.push_back(point);
    }
  }
  return chart({"Falloff of the lens", "off the camera's axis (deg)", "responsivity (%)",
                "To the picture's corner. Samples are seen where the white was."},
               {beyond, curve});
}

}  // namespace

std::string light_section(const CalibrationReportData& data) {
  Facts facts;
  std::string figures = warm_up(data, facts);
  if (const auto& fields = data.findings.fields) {
    facts.emplace_back("Fields",
                       fmt::format("residual {:.2g} % rms, chi² per degree of freedom {:.3g}",
                                   100.0 * fields->residual_rms, fields->chi2_per_dof));
    const std::vector<WhiteResidual> residuals = white_residuals(data);
    figures += lamp_field(fields->lamp_field, residuals);
    figures += flat_field(data, residuals);
    figures += falloff(data, residuals);
  }
  if (const auto& stray = data.findings.stray) {
    facts.emplace_back("Stray light",
                       fmt::format("{:.2g} % of a white, {:.2g} % at worst",
                                   100.0 * stray->fraction, 100.0 * stray->worst_fraction));
  }
  if (const auto& white = data.findings.white) {
    facts.emplace_back("White",
                       fmt::format("two takes differ by {:.2g} %", 100.0 * white->disagreement));
  }
  return section("Light and white", facts, figures);
}

}  // namespace gonio::calibration_report
