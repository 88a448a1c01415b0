#include "gonio/calibration/radiometry/white_view.h"

#include <fmt/format.h>

#include <cmath>
#include <string>

#include "gonio/calibration/result/step_refused.h"
#include "gonio/instrument/measurement_equation.h"

namespace gonio::calibration {
namespace {

void require_view(bool ok, std::size_t view, const std::string& found, const char* expected) {
  if (!ok) throw StepRefused(fmt::format("view {}: found {}, expected {}", view, found, expected));
}

}  // namespace

std::optional<WhiteFactor> white_factor(const instrument::Instrument& instrument,
                                        const WhiteView& view, const PixelSignal& pixel) {
  const rig::RigPose pose = rig::forward(instrument.rig, view.joints);
  const auto geometry = instrument::pixel_geometry(instrument, pose, pixel.column, pixel.row);
  if (!geometry || !(geometry->factor > 0.0)) return std::nullopt;
  const double white = instrument::white_brdf(instrument.white, geometry->directions)[view.channel];
  const Eigen::Vector3d in_lamp =
      pose.world_from_lamp.inverse() * (pose.world_from_sample * geometry->point_in_sample_mm);
  const double x = (pixel.column - instrument.camera.cx_px) / instrument.camera.fx_px;
  const double y = (pixel.row - instrument.camera.cy_px) / instrument.camera.fy_px;
  return WhiteFactor{view.monitor * instrument::signal_over_constant(instrument, *geometry, white),
                     in_lamp.x() / in_lamp.z(), in_lamp.y() / in_lamp.z(), x * x + y * y};
}

void require_white_views(const instrument::Instrument& instrument,
                         const std::vector<WhiteView>& views) {
  if (views.empty()) throw StepRefused("found no view, expected at least one");
  for (std::size_t i = 0; i < views.size(); ++i) {
    const WhiteView& view = views[i];
    require_view(view.joints.size() == instrument.rig.axes.size(), i,
                 fmt::format("{} joints", view.joints.size()), "one per axis");
    require_view(view.channel >= 0 && view.channel < 3, i, fmt::format("channel {}", view.channel),
                 "0 to 2");
    require_view(std::isfinite(view.monitor) && view.monitor > 0.0, i,
                 fmt::format("a lamp monitor of {:g}", view.monitor),
                 "a positive reading: is the lamp on?");
    require_view(std::isfinite(view.exposure_s) && view.exposure_s > 0.0, i,
                 fmt::format("an exposure of {:g} s", view.exposure_s), "one above 0");
    require_view(!view.pixels.empty(), i, "no pixel", "at least one on the target");
    for (const PixelSignal& pixel : view.pixels) {
      require_view(std::isfinite(pixel.column) && std::isfinite(pixel.row), i,
                   "a pixel that is not finite", "column and row");
      require_view(std::isfinite(pixel.dn_per_s) && std::isfinite(pixel.sigma_dn_per_s) &&
                       pixel.sigma_dn_per_s > 0.0,
                   i, fmt::format("{:g} +- {:g} DN/s", pixel.dn_per_s, pixel.sigma_dn_per_s),
                   "finite numbers and a positive sigma");
    }
  }
}

}  // namespace gonio::calibration
