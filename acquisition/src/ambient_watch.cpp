#include "ambient_watch.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "trust_checks.h"

namespace gonio::acquisition {
namespace {

/// Of the wanted sigma: an error of one half adds an eighth to it.
constexpr double kOfConsequence = 0.5;
/// So many changes within so many frames are no steps. A point that is measured again agrees with
/// itself, so that light that differs by the pose shows in every other frame.
constexpr std::size_t kRecent = 8;
constexpr std::ptrdiff_t kMostSteps = 4;
/// So many steady comparisons in a row after that, and it is looked at again. Given up, nothing is
/// measured again: light that differs by the pose then shows in nearly every frame, and one that
/// comes and goes slowly needs as long a rest as it took to tell. Fewer would be reached by chance
/// where poses are neighbours, and cost four points measured twice each time.
constexpr std::size_t kSteady = 8;

}  // namespace

void AmbientWatch::begin_darks() {
  dark_sums_dn_.clear();
  darks_ = 0;
}

void AmbientWatch::add_dark(const devices::Frame& frame) {
  dark_sums_dn_.resize(frame.pixels_dn.size(), 0);
  for (std::size_t i = 0; i < frame.pixels_dn.size(); ++i) dark_sums_dn_[i] += frame.pixels_dn[i];
  ++darks_;
}

AmbientWatch::Level AmbientWatch::level_of(const devices::Frame& lamp_off,
                                           const Regions& regions) const {
  double sum_dn = 0.0;
  double pixels = 0.0;
  for (const std::vector<std::size_t>& region : regions) {
    for (const std::size_t pixel : region) {
      const double dark_dn = static_cast<double>(dark_sums_dn_[pixel]) / darks_;
      sum_dn += sensor_.response.linear_dn(lamp_off.pixels_dn[pixel] - dark_dn);
    }
    pixels += static_cast<double>(region.size());
  }
  const double mean_dn = sum_dn / pixels;
  const double read_dn = sensor_.gain_dn_per_e * sensor_.read_noise_e;
  const double variance_dn2 = (read_dn * read_dn + 1.0 / 12.0) * (1.0 + 1.0 / darks_) +
                              sensor_.gain_dn_per_e * std::max(0.0, mean_dn);
  const double exposed_s = devices::to_seconds(lamp_off.exposure) + sensor_.shutter_offset_s;
  return {mean_dn / exposed_s, std::sqrt(variance_dn2 / pixels) / exposed_s};
}

std::string AmbientWatch::changed(const devices::Frame& lamp_off, devices::Target target,
                                  const Regions& regions, double dimmest_dn_per_s) {
  const Level now = level_of(lamp_off, regions);
  const auto same = last_.find(target);
  const auto before = same != last_.end() ? same : last_.begin();
  if (before == last_.end()) {
    last_[target] = now;
    return {};
  }
  std::string text = change_since(before->second, now, dimmest_dn_per_s);
  last_[target] = now;
  recent_.push_back(!text.empty());
  if (recent_.size() > (given_up_ ? kSteady : kRecent)) recent_.pop_front();
  const auto steps = std::count(recent_.begin(), recent_.end(), true);
  if (given_up_) {
    if (steps > 0 || recent_.size() < kSteady) return {};
    given_up_ = false;
    warn_(fmt::format("the light of the room was steady for {} frames: it is looked at again",
                      kSteady));
    return {};
  }
  if (steps >= kMostSteps) {
    given_up_ = true;
    recent_.clear();
    warn_(
        "the light of the room changes so often that it may differ by the pose: it is not looked "
        "at until it is steady");
  }
  return text;
}

std::string AmbientWatch::change_since(const Level& before, const Level& now,
                                       double dimmest_dn_per_s) const {
  const double change = now.dn_per_s - before.dn_per_s;
  // Dark current is another in other pixels, and doubles every few degrees: no light.
  const double dark_dn_per_s = sensor_.gain_dn_per_e * sensor_.dark_current_e_per_s;
  const double u = std::hypot(now.u_dn_per_s, before.u_dn_per_s, dark_dn_per_s);
  if (std::abs(change) <= kStepSigmas * u) return {};
  const double signal = dimmest_dn_per_s - std::max(now.dn_per_s, before.dn_per_s);
  const double limit = kOfConsequence * options_.relative_sigma * signal;
  if (!(dimmest_dn_per_s > 0.0) || std::abs(change) <= limit) return {};
  return fmt::format(
      "with the lamp off it became {} by {:.3g} DN/s since the frame before, expected within "
      "{:.3g} DN/s: did the light of the room change?",
      change > 0.0 ? "brighter" : "darker", std::abs(change), std::max(limit, kStepSigmas * u));
}

}  // namespace gonio::acquisition
