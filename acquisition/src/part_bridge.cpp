#include "gonio/acquisition/part_bridge.h"

#include <fmt/format.h>

#include <cmath>

namespace gonio::acquisition {
namespace {

/// A change by more than so many of its uncertainties is told from noise.
constexpr double kTellingSigmas = 2.0;
/// Whites and sentinels further apart do not mean the same: in three colours one bridge in 120,
/// were the uncertainty all noise. Most of it is what a sentinel's pose may do.
constexpr double kContradictingSigmas = 3.0;

int most_telling(const brdf::Rgb& value, const brdf::Rgb& u) {
  int colour = 0;
  (value.abs() / u).maxCoeff(&colour);
  return colour;
}

}  // namespace

bool PartBridge::is_refused() const {
  return std::abs(disagreement_relative) > kContradictingSigmas * u_disagreement_relative;
}

bool PartBridge::is_applied() const {
  return !is_refused() && std::abs(change_relative) > kTellingSigmas * u_relative;
}

PartBridge bridge_parts(const LevelChange& white, const std::optional<LevelChange>& sentinel,
                        double u_monitor) {
  PartBridge bridge;
  bridge.relative = white.relative;
  brdf::Rgb own_variance = white.variance;
  if (sentinel) {
    const brdf::Rgb sum = white.variance + sentinel->variance;
    // Of factors: their logarithms, so that a chain of bridges is the product of each.
    const brdf::Rgb log_factor = ((1.0 + white.relative).log() * sentinel->variance +
                                  (1.0 + sentinel->relative).log() * white.variance) /
                                 sum;
    bridge.relative = log_factor.exp() - 1.0;
    own_variance = white.variance * sentinel->variance / sum;
    bridge.by_sentinel = true;
    const brdf::Rgb apart = white.relative - sentinel->relative;
    const int colour = most_telling(apart, sum.sqrt());
    bridge.disagreement_relative = apart[colour];
    bridge.u_disagreement_relative = std::sqrt(sum[colour]);
  }
  // A reading before and one after.
  const brdf::Rgb u = (own_variance + 2.0 * u_monitor * u_monitor).sqrt();
  const int colour = most_telling(bridge.relative, u);
  bridge.change_relative = bridge.relative[colour];
  bridge.u_relative = u[colour];
  return bridge;
}

std::string to_text(const PartBridge& bridge) {
  const std::string where = fmt::format("white at {:.0f} s, after an interruption: ", bridge.at_s);
  if (bridge.is_refused()) {
    return where + fmt::format(
                       "unbridged: the change by the whites less that by the sentinels is "
                       "{:+.2f} +- {:.2f} %; was the white or the sample touched or soiled "
                       "meanwhile? Each part is taken with its own whites",
                       100.0 * bridge.disagreement_relative,
                       100.0 * bridge.u_disagreement_relative);
  }
  return where +
         fmt::format(
             "the light over the lamp's monitor is {:+.2f} +- {:.2f} % off that before by {}; {}",
             100.0 * bridge.change_relative, 100.0 * bridge.u_relative,
             bridge.by_sentinel ? "whites and sentinels" : "whites alone",
             bridge.is_applied() ? "bridged with that factor, each part with its own whites"
                                 : "no change beyond noise, no factor is applied");
}

}  // namespace gonio::acquisition
