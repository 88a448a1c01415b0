#pragma once

#include <Eigen/Core>
#include <vector>

#include "gonio/calibration/radiometry/verification.h"

namespace gonio::calibration {

/// The lamp's image in a polished flat target in one pose.
struct GlassView {
  rig::Joints joints;                               ///< as they were read
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();  ///< where the image stands
  /// Of all of the image: DN/s of the linear signal, per unit of the lamp's monitor; above 0.
  double light = 0.0;
};

/// How black glass reflects the lamp over what Fresnel's equations say, each view over the first,
/// for what a filter before it passes is not known.
///
/// Angle    Of incidence: half of that between lamp and camera as the calibrated rig sees them from
///          the point where the image stands, which a glass that leans by a little does not change.
///          Its error is half of the lamp's direction's: at 70 deg a hundredth of a degree is
///          0.08 % of the reflectance, nothing beside the limit.
/// Light    Over the lamp's field towards that point, the lens' falloff there, and the square of
///          the way from lamp to camera.
/// `index`  Refractive, of the glass; above 1. Its error of 0.01 is 0.4 % at 70 deg over 30 deg.
/// Limit    5 %: unpolarised light is assumed, and dirt shows at grazing angles first.
/// Throws   StepRefused: fewer than two views, an image that the plane cannot show, no light.
std::vector<RatioCheck> glass_ratios(const instrument::Instrument& instrument,
                                     const std::vector<GlassView>& views, double index);

}  // namespace gonio::calibration
