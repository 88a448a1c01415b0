#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

#include "chart.h"
#include "sections.h"

namespace gonio::calibration_report {
namespace {

using calibration::geometry::FittedView;
using calibration::geometry::StageView;
using page::Point;

// A mean of fewer is mostly noise, and would be the longest needle.
constexpr int kLeastCorners = 5;

/// A corner where it was seen, and by how much it was seen off the model (px, y down).
struct CornerResidual {
  Eigen::Vector2d pixel;
  Eigen::Vector2d off;
};

std::vector<CornerResidual> corner_residuals(const instrument::CameraModel& camera,
                                             const std::vector<FittedView>& fitted,
                                             const std::vector<StageView>& seen) {
  std::vector<CornerResidual> all;
  for (std::size_t v = 0; v < std::min(fitted.size(), seen.size()); ++v) {
    if (!fitted[v].used) continue;
    for (const auto& corner : seen[v].board.corners) {
      const Eigen::Vector3d at = fitted[v].camera_from_board *
                                 Eigen::Vector3d(corner.point_mm.x(), corner.point_mm.y(), 0.0);
      if (at.z() > 0.0) all.push_back({corner.pixel, corner.pixel - camera.project(at)});
    }
  }
  return all;
}

/// All that are far off and every so many-th of the others, at most about 3000.
Series thinned(const std::vector<CornerResidual>& corners, double rms, std::string& note) {
  constexpr std::size_t kMost = 3000;
  const std::size_t every = (corners.size() + kMost - 1) / kMost;
  Series series{{}, "dot g", "corners"};
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const Eigen::Vector2d& off = corners[i].off;
    if (i % every == 0 || off.norm() > 3.0 * rms) series.points.push_back({off.x(), off.y()});
  }
  note = series.points.size() == corners.size()
             ? fmt::format("All {} corners.", corners.size())
             : fmt::format("{} of {} corners: every {}th and all beyond three rms.",
                           series.points.size(), corners.size(), every);
  return series;
}

/// Mean residual by place in the picture, as needles: lens distortion that the model does not know
/// shows as a pattern, noise does not.
std::string needles(const std::string& title, const instrument::CameraModel& camera,
                    const std::vector<CornerResidual>& corners) {
  constexpr int kAcross = 12;
  const double side = static_cast<double>(camera.width_px) / kAcross;
  if (!(side > 0.0)) return {};
  std::map<std::pair<int, int>, std::pair<Eigen::Vector2d, int>> fields;
  for (const CornerResidual& corner : corners) {
    auto& [sum, count] = fields
                             .try_emplace({static_cast<int>(corner.pixel.x() / side),
                                           static_cast<int>(corner.pixel.y() / side)},
                                          Eigen::Vector2d::Zero(), 0)
                             .first->second;
    sum += corner.off;
    ++count;
  }
  MapOptions options;
  options.low = {-0.5, -0.5};
  options.high = {camera.width_px - 0.5, camera.height_px - 0.5};
  std::erase_if(fields, [](const auto& field) { return field.second.second < kLeastCorners; });
  double longest = 0.0;
  for (const auto& [field, mean] : fields) {
    longest = std::max(longest, mean.first.norm() / mean.second);
  }
  if (!(longest > 0.0)) return {};
  Series feet{{}, "dot b", ""};
  std::vector<Series> series;
  const double pixels_per_px = 0.9 * side / longest;
  for (const auto& [field, mean] : fields) {
    const Point foot{(field.first + 0.5) * side, (field.second + 0.5) * side};
    const Eigen::Vector2d off = pixels_per_px * mean.first / mean.second;
    feet.points.push_back(foot);
    series.push_back({{foot, {foot.x + off.x(), foot.y + off.y()}}, "curve b", ""});
  }
  series.push_back(feet);
  return field_map({title, "column (px)", "row (px)",
                    fmt::format("Mean of the corners in each field; the longest is {:.2g} px. "
                                "Needles that swirl or fan out are a lens the model does not know.",
                                longest)},
                   options, {}, series);
}

std::string reprojection(const std::string& name, const CalibrationReportData& data,
                         const std::string& step, const instrument::CameraModel& camera,
                         const std::vector<FittedView>& fitted, double rms) {
  const auto* seen = seen_by(data, step);
  if (seen == nullptr) return {};
  const auto corners = corner_residuals(camera, fitted, seen->boards);
  if (corners.empty()) return {};
  std::string note;
  const Series cloud = thinned(corners, rms, note);
  Series circle{{{0.0, 0.0}}, "curve r", fmt::format("rms {:.3g} px", rms)};
  return scatter({"Reprojection: " + name, "dx, to the right (px)", "dy, down (px)", note},
                 {cloud, circle}, rms) +
         needles("Reprojection over the picture: " + name, camera, corners);
}

std::string views(const std::string& name, const std::vector<FittedView>& fitted) {
  Series used{{}, "dot g", "in the fit"};
  Series left_out{{}, "off beyond", "left out"};
  for (std::size_t i = 0; i < fitted.size(); ++i) {
    (fitted[i].used ? used : left_out)
        .points.push_back({static_cast<double>(i + 1), fitted[i].rms_px});
  }
  return chart({"Misfit by view: " + name, "view", "rms (px)",
                "A view that stands out was blurred, hidden in part or seen while something moved; "
                "the step refuses 0.3 px of all."},
               {used, left_out}, {.with_zero = true});
}

std::string axis_fit(const CalibrationReportData& data) {
  const auto& stage = *data.findings.stage;
  const auto* seen = seen_by(data, "stage_axes");
  if (seen == nullptr) return {};
  std::string figures;
  const auto& links = stage.rig.sample.links;
  for (std::size_t k = 0; k < std::min<std::size_t>(2, links.size()); ++k) {
    const std::size_t axis = links[k].axis;
    Series arrivals{{}, "dot g", ""};
    for (std::size_t v = 0; v < std::min(stage.joint_residuals.size(), seen->boards.size()); ++v) {
      const auto& joints = seen->boards[v].joints;
      if (axis >= joints.size()) continue;
      arrivals.points.push_back(
          {joints[axis].degrees(),
           kMilliDegrees * stage.joint_residuals[v][static_cast<Eigen::Index>(k)]});
    }
    const std::string name = axis < stage.rig.axes.size() ? stage.rig.axes[axis].name : "";
    figures += chart(
        {"Axis fit: " + name, name + " (deg)", "off its reading (mdeg)",
         "From each pose's own corners, which tell little where the board faces the camera. A wave "
         "over the angle is an eccentric encoder, a slope a wrong gear ratio."},
        {arrivals}, {.with_zero = true});
  }
  return figures;
}

}  // namespace

std::string geometry_section(const CalibrationReportData& data) {
  Facts facts;
  std::string figures;
  if (const auto& camera = data.findings.intrinsics) {
    facts.emplace_back("Intrinsics", fmt::format("{:.3g} px rms", camera->rms_px));
    figures += reprojection("intrinsics", data, "intrinsics", camera->camera, camera->views,
                            camera->rms_px);
    figures += views("intrinsics", camera->views);
  }
  if (const auto& stage = data.findings.stage) {
    facts.emplace_back("Stage axes", fmt::format("{:.3g} px rms", stage->rms_px));
    figures +=
        reprojection("stage axes", data, "stage_axes", stage->camera, stage->views, stage->rms_px);
    figures += views("stage axes", stage->views) + axis_fit(data);
  }
  return section("Camera and stage", facts, figures);
}

}  // namespace gonio::calibration_report
