#include <stdexcept>

#include "gonio/calibration/routine/findings.h"

namespace gonio::calibration::routine {
namespace {

/// Darks and bad pixels share the map: each has bits of its own.
void forget_pixels(std::uint8_t bits, std::vector<std::uint8_t>& map) {
  for (std::uint8_t& pixel : map) pixel = static_cast<std::uint8_t>(pixel & ~bits);
}

}  // namespace

void forget(std::string_view step, Findings& findings) {
  findings.seen_after.erase(std::string(step));
  if (step == "homing") {
    findings.homing.clear();
  } else if (step == "backlash") {
    findings.repeatability.clear();
  } else if (step == "settle_time") {
    findings.settling.clear();
  } else if (step == "warm_up") {
    findings.lamp.reset();
  } else if (step == "darks") {
    findings.darks.reset();
    forget_pixels(sensor::defect::kHot | sensor::defect::kBlinking, findings.bad_pixels);
  } else if (step == "linearity") {
    findings.linearity.reset();
  } else if (step == "photon_transfer") {
    findings.photon_transfer.reset();
    findings.non_uniformity.reset();
  } else if (step == "bad_pixels") {
    forget_pixels(sensor::defect::kCold, findings.bad_pixels);
  } else if (step == "intrinsics") {
    findings.intrinsics.reset();
  } else if (step == "stage_axes") {
    findings.stage.reset();
  } else if (step == "sample_plane") {
    findings.sample_plane.reset();
  } else if (step == "lamp_arm") {
    findings.lamp_arm.reset();
  } else if (step == "zero_offsets") {
    findings.peaks.clear();
    findings.zeros.reset();
  } else if (step == "flat_field") {
    findings.fields.reset();
  } else if (step == "stray_light") {
    findings.stray.reset();
  } else if (step == "white") {
    findings.white.reset();
  } else if (step == "colour") {
    findings.colour.reset();
  } else if (step == "verification") {
    findings.verification.reset();
  } else {
    throw std::invalid_argument("no calibration step is called " + std::string(step));
  }
}

}  // namespace gonio::calibration::routine
