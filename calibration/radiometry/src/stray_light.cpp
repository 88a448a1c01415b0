#include "gonio/calibration/radiometry/stray_light.h"

#include <fmt/format.h>

#include <cmath>
#include <numbers>

#include "gonio/calibration/result/step_refused.h"
#include "gonio/rig/kinematics.h"

namespace gonio::calibration {

StrayLight stray_light(const instrument::Instrument& instrument,
                       const std::array<double, 3>& constant,
                       const std::vector<WhiteView>& trap_views, double limit) {
  require_white_views(instrument, trap_views);
  std::vector<double> fraction;
  std::vector<double> variance;
  for (std::size_t v = 0; v < trap_views.size(); ++v) {
    const WhiteView& view = trap_views[v];
    const double channel_constant = constant[static_cast<std::size_t>(view.channel)];
    if (!(channel_constant > 0.0)) {
      throw StepRefused(fmt::format(
          "view {}: found no instrument constant of channel {}, expected one: measure the white "
          "first",
          v, view.channel));
    }
    const rig::RigPose pose = rig::forward(instrument.rig, view.joints);
    const double square_mm =
        pose.collimated_lamp
            ? 1.0
            : (pose.world_from_lamp.translation() - pose.world_from_sample.translation())
                  .squaredNorm();
    const double white = channel_constant * view.monitor * std::numbers::inv_pi / square_mm;
    double weights = 0.0;
    double sum = 0.0;
    for (const PixelSignal& pixel : view.pixels) {
      const double weight = 1.0 / (pixel.sigma_dn_per_s * pixel.sigma_dn_per_s);
      weights += weight;
      sum += weight * pixel.dn_per_s;
    }
    fraction.push_back(sum / weights / white);
    variance.push_back(1.0 / (weights * white * white));
  }

  StrayLight stray;
  const auto count = static_cast<double>(fraction.size());
  double mean_variance = 0.0;
  for (std::size_t v = 0; v < fraction.size(); ++v) {
    stray.fraction += fraction[v] / count;
    mean_variance += variance[v] / count;
    if (v == 0 || fraction[v] > stray.worst_fraction) {
      stray.worst_fraction = fraction[v];
      stray.worst_view = static_cast<int>(v);
    }
  }
  if (fraction.size() > 1) {
    double square = 0.0;
    for (const double value : fraction) square += std::pow(value - stray.fraction, 2);
    stray.spread = std::sqrt(std::max(0.0, square / (count - 1.0) - mean_variance));
  }
  stray.sigma = std::sqrt((mean_variance + stray.spread * stray.spread) / count);
  if (!(stray.worst_fraction <= limit)) {
    throw StepRefused(fmt::format(
        "view {}: found stray light of {:.3f} % of white, expected at most {:.3f} %: is the black "
        "trap mounted, and does something bright stand beside it?",
        stray.worst_view, 100.0 * stray.worst_fraction, 100.0 * limit));
  }
  return stray;
}

}  // namespace gonio::calibration
