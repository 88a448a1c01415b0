#pragma once

#include <array>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

#include "gonio/calibration/radiometry/white_view.h"
#include "gonio/instrument/acceptance_check.h"

namespace gonio::calibration {

/// Where the lamp's mirror image was seen in one pose of a flat mirror or black glass.
struct HighlightView {
  rig::Joints joints;
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();
  double sigma_px = 0.1;
};

/// A reading that has one right value: black glass against Fresnel, and what white_ratios() says.
struct RatioCheck {
  std::string name;
  double found = 1.0;
  double expected = 1.0;
  double tolerance = 0.01;  ///< relative
};

/// What verification looks at, all taken after the calibration and not used by it.
struct VerificationData {
  std::array<double, 3> constant{};  ///< FieldFit::constant of the calibration under test
  std::vector<WhiteView> white;      ///< at poses other than the reference's
  /// How far the white reaches from its middle; what lies beyond says nothing of it.
  double white_half_width_mm = std::numeric_limits<double>::infinity();
  std::vector<HighlightView> mirror;  ///< at three lamp angles or more
  std::vector<RatioCheck> ratios;     ///< besides those of the white, which verify() adds
  std::vector<std::string> unseen;    ///< what was looked for and not found, a line each
};

/// A single mistake that could explain the residuals.
enum class Cause {
  none,
  stale_white,         ///< one factor on all of a colour: white, lamp or constant are old
  zero_offset,         ///< an axis counts from another zero
  axis_sign,           ///< an axis turns the other way
  response_curve,      ///< signal goes with a power of the light: gamma, lookup table
  cosine_of_view,      ///< a factor cos theta_o that does not belong there
  inverse_square_law,  ///< 1/r^2 left out
  unknown
};

std::string_view to_string(Cause cause);

struct Verification {
  bool passed = false;
  std::vector<instrument::AcceptanceCheck> checks;  ///< of largest deviations: relative, deg
  Cause cause = Cause::none;  ///< the likeliest of a failure; none when passed
  std::string explanation;    ///< one line for a person; names the axis; empty when passed
  double explained = 0.0;     ///< share of the residuals' chi^2 that the cause takes away
};

/// Compares what was measured with what the calibrated instrument predicts, and names the single
/// mistake that explains a failure best: every cause is a change of the forward model whose size is
/// fitted to the same residuals (chi^2); a second parameter has to earn its place. Poses that
/// showed nothing (`unseen`) leave the naming to the rest: an axis that turns the other way takes
/// the lamp's image out of the mirror.
///
/// Limits   white 1.5 % per region mean, mirror image 0.05 deg of wi, the white's light into all
///          directions 0.75 % about its certificate's, ratios as each says (white_ratios.h:
///          repeated pose, reciprocity, energy).
/// Throws   StepRefused: as require_white_views(); fewer than 3 white poses; a white as expected
///          beside fewer than 3 mirror poses or with something unseen.
Verification verify(const instrument::Instrument& instrument, const VerificationData& data);

}  // namespace gonio::calibration
