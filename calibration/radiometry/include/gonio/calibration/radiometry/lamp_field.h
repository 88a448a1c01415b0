#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "gonio/calibration/radiometry/white_view.h"
#include "gonio/calibration/result/calibrated_rig.h"

namespace gonio::calibration {

/// Instrument constants, lamp field and the lens' falloff, found together from views of the white.
struct FieldFit {
  instrument::LampField lamp_field;
  instrument::Vignetting vignetting;
  std::array<double, 3> constant{};  ///< C per channel in DN/s mm^2 sr per unit of monitor
  /// Of ln C per channel that was seen (in channel order), c10 c01 c20 c11 c02, v1 v2 v3: of noise,
  /// scaled by the residuals where they are larger than the sigmas said, of what all pixels of a
  /// pose and of a view are off by together, and of the geometry.
  Eigen::MatrixXd covariance;
  /// Relative sd of field times falloff against their value on the axes; rms over the pixels seen.
  double field_sigma = 0.0;
  double residual_rms = 0.0;  ///< relative
  double chi2_per_dof = 0.0;  ///< against the sigmas given
  int iterations = 0;
};

/// Fits ln S = ln C + ln V(q) + ln I(x, y) + ln(f_w cos theta_i / r^2) by Gauss-Newton. Falloff of
/// the lens and field of the lamp look alike in one pose; views from other arm angles and tilts
/// turn one against the other. v1, v2, v3 are known beforehand to be within 5, 10 and 30 of zero
/// (1 sigma), as lenses are.
///
/// `instrument`      gives geometry, white and where the fit starts.
/// `one_sigma_rigs`  What the geometry is uncertain by: rigs that differ from the instrument's by
///                   one standard deviation of an independent error each. The covariance says how
///                   far the fit would move with them, to first order.
/// Throws   StepRefused: as require_white_views(); views that cannot tell lamp from lens: the
///          falloff's relative sd above `limit` somewhere (0.005 is what an instrument of one
///          percent can afford); a residual above `limit`, naming the worst view.
/// Source   E = I cos theta / r^2 of a small source; linear in the field's coefficients.
FieldFit fit_fields(const instrument::Instrument& instrument, const std::vector<WhiteView>& views,
                    const std::vector<CalibratedRig>& one_sigma_rigs = {}, double limit = 0.005);

}  // namespace gonio::calibration
