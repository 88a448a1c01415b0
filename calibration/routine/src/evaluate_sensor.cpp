#include <algorithm>

#include "evaluate_steps.h"
#include "gonio/calibration/result/step_refused.h"
#include "gonio/calibration/sensor/darks.h"

namespace gonio::calibration::routine {
namespace {

constexpr double kMaxBlackChange_dn = 0.1;
constexpr double kMaxReadNoise_e = 10.0;  // machine-vision sensors have a few

void mark(const std::vector<DefectivePixel>& defects, const instrument::Instrument& nominal,
          std::vector<std::uint8_t>& mask) {
  const auto pixels = static_cast<std::size_t>(nominal.camera.width_px) *
                      static_cast<std::size_t>(nominal.camera.height_px);
  mask.resize(pixels, 0);
  for (const DefectivePixel& defect : defects) {
    if (defect.index >= pixels) {
      throw StepRefused(
          "found a defective pixel outside the picture, expected observations of "
          "this camera");
    }
    mask[defect.index] = static_cast<std::uint8_t>(mask[defect.index] | defect.bits);
  }
}

double bad_share(const std::vector<std::uint8_t>& mask) {
  const auto bad = std::count_if(mask.begin(), mask.end(), [](std::uint8_t m) { return m != 0; });
  return static_cast<double>(bad) / static_cast<double>(std::max<std::size_t>(mask.size(), 1));
}

}  // namespace

void evaluate_warm_up(const Observations& seen, const Known&, Findings& findings,
                      ResultBuilder& result) {
  const sensor::LampStability found = sensor::fit_lamp_stability(seen.lamp);
  findings.lamp = found;
  result.block({{"lamp.level_dn", "DN", found.level.value},
                {"lamp.warm_up_amplitude", "", found.amplitude.value},
                {"lamp.warm_up_tau_s", "s", found.tau_s.value}},
               found.covariance);
  result.parameter("lamp.drift_per_10_min", "", found.drift_per_10_min);
  result.residual("relative_sigma", found.sigma);
  result.residual("warm_after_s", found.warm_after_s.value);
  result.check(found.acceptance);
}

void evaluate_darks(const Observations& seen, const Known& known, Findings& findings,
                    ResultBuilder& result) {
  if (!seen.darks) throw StepRefused("found no dark frames, expected their summary");
  findings.darks = seen.darks;
  findings.bad_pixels.clear();
  mark(seen.defects, known.nominal, findings.bad_pixels);
  result.parameter("sensor.black_level_dn", "DN", seen.darks->black_level_dn);
  result.parameter("sensor.dark_current_dn_per_s", "DN/s", seen.darks->dark_current_dn_per_s);
  result.parameter("sensor.temporal_noise_dn", "DN", seen.darks->temporal_noise_dn);
  result.residual("hot_or_blinking", seen.darks->bad_fraction);
  result.check("black level stability (DN)", seen.darks->black_change_dn, kMaxBlackChange_dn);
  result.check("hot or blinking pixels (fraction)", seen.darks->bad_fraction,
               known.settings.max_bad_pixel_fraction);
}

void evaluate_photon_transfer(const Observations& seen, const Known& known, Findings& findings,
                              ResultBuilder& result) {
  sensor::PhotonTransferOptions options;
  options.saturation_dn = known.nominal.sensor.saturation_dn;
  if (findings.linearity) {
    options.response = findings.linearity->curve;
    options.curved = false;
  }
  const sensor::PhotonTransfer found =
      sensor::fit_photon_transfer(seen.dark_levels, seen.levels, options);
  if (!seen.non_uniformity) throw StepRefused("found no flat stack, expected one");
  findings.photon_transfer = found;
  findings.non_uniformity = seen.non_uniformity;
  result.block({{"sensor.gain_dn_per_e", "DN/e", found.gain_dn_per_e.value},
                {"sensor.read_noise_e", "e", found.read_noise_e.value}},
               found.covariance);
  if (found.full_well_e) result.parameter("sensor.full_well_e", "e", *found.full_well_e);
  result.parameter("sensor.saturation_dn", "DN", found.saturation_dn);
  result.parameter("sensor.prnu", "", seen.non_uniformity->prnu);
  result.parameter("sensor.dsnu_dn", "DN", seen.non_uniformity->dsnu_dn);
  result.residual("chi2_per_dof", found.chi2_per_dof);
  result.residual("light_noise", found.light_noise);
  result.check("relative sigma of the gain", found.gain_dn_per_e.sigma / found.gain_dn_per_e.value,
               0.01);
  result.check("read noise (e)", found.read_noise_e.value, kMaxReadNoise_e);
  if (found.read_noise_is_bound) result.note("quantisation hides the read noise: an upper bound");
}

void evaluate_linearity(const Observations& seen, const Known& known, Findings& findings,
                        ResultBuilder& result) {
  sensor::LinearityOptions options;
  options.saturation_dn = known.nominal.sensor.saturation_dn;
  const sensor::Linearity found = sensor::fit_linearity(seen.dark_levels, seen.levels, options);
  findings.linearity = found;
  result.block({{"sensor.rate_dn_per_s", "DN/s", found.rate_dn_per_s.value},
                {"sensor.shutter_offset_s", "s", found.shutter_offset_s.value},
                {"sensor.curve_c1", "", found.curve.c1},
                {"sensor.curve_c2", "", found.curve.c2}},
               found.covariance);
  result.residual("le_percent", found.le_percent);
  result.residual("after_curve_percent", found.after_curve_percent);
  result.residual("chi2_per_dof", found.chi2_per_dof);
  result.check(found.acceptance);
}

void evaluate_bad_pixels(const Observations& seen, const Known& known, Findings& findings,
                         ResultBuilder& result) {
  // Those of the darks stay, those of an earlier flat picture do not.
  for (std::uint8_t& mask : findings.bad_pixels) {
    mask = static_cast<std::uint8_t>(mask & ~sensor::defect::kCold);
  }
  mark(seen.defects, known.nominal, findings.bad_pixels);
  const double share = bad_share(findings.bad_pixels);
  result.residual("bad_fraction", share);
  result.residual("cold", static_cast<double>(seen.defects.size()));
  result.check("pixels that are not used (fraction)", share, known.settings.max_bad_pixel_fraction);
}

}  // namespace gonio::calibration::routine
