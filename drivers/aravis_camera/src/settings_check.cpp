#include "settings_check.h"

#include <algorithm>
#include <cmath>

#include "gonio/aravis_camera/wire_format.h"
#include "text.h"

namespace gonio::aravis_camera {
namespace {

constexpr double kGainToleranceDb = 0.1;
constexpr double kBlackLevelToleranceUnits = 1.0;

bool same(const Region& a, const Region& b) {
  return a.x == b.x && a.y == b.y && a.width == b.width && a.height == b.height;
}

std::string gain_difference(const AravisCameraOptions& options, const std::string& feature,
                            double gain) {
  if (feature.empty()) return {};
  if (feature != "GainRaw") {
    if (std::abs(gain - options.gain_db) <= kGainToleranceDb) return {};
    return joined("gain is ", gain, " dB, asked ", options.gain_db, " dB");
  }
  if (options.gain_raw_per_db == 0.0) return {};  // no unit to compare in
  const double asked = options.gain_db * options.gain_raw_per_db;
  if (std::abs(gain - asked) <= 1.0) return {};
  return joined("GainRaw is ", gain, ", asked ", asked);
}

}  // namespace

std::string difference(const AravisCameraOptions& options, const CameraIdentity& identity,
                       const CameraState& state, std::optional<std::chrono::nanoseconds> exposure,
                       bool free_running) {
  if (!state.automatic.empty()) return state.automatic.front() + " is on";
  if (state.pixel_format != find_wire_format(options.pixel_format)->code) {
    return joined("pixel format is ", format_text(state.pixel_format), ", asked ",
                  options.pixel_format);
  }
  if (!same(state.region, identity.region)) {
    return joined("region is ", as_text(state.region), ", asked ", as_text(identity.region));
  }
  if (exposure) {
    const double asked_us = static_cast<double>(exposure->count()) / 1000.0;
    const double allowed = std::max(kExposureTolerance * asked_us, kExposureToleranceUs);
    if (!(std::abs(state.exposure_us - asked_us) <= allowed)) {
      return joined("exposure is ", state.exposure_us, " us, asked ", asked_us, " us");
    }
  }
  if (const std::string gain = gain_difference(options, identity.gain_feature, state.gain);
      !gain.empty()) {
    return gain;
  }
  if (!identity.black_level_feature.empty()) {
    const double asked = options.black_level_dn / options.black_level_unit_dn;
    if (!(std::abs(state.black_level - asked) <= kBlackLevelToleranceUnits)) {
      return joined(identity.black_level_feature, " is ", state.black_level, ", asked ", asked);
    }
  }
  if (state.triggered == free_running) {
    return joined("trigger mode is ", state.triggered ? "on" : "off");
  }
  const std::string source = options.trigger_line.empty() ? "Software" : options.trigger_line;
  if (!free_running && state.trigger_source != source) {
    return joined("trigger source is ", state.trigger_source, ", asked ", source);
  }
  return {};
}

}  // namespace gonio::aravis_camera
