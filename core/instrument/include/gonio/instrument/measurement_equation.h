#pragma once

#include <Eigen/Core>
#include <optional>

#include "gonio/instrument/instrument.h"
#include "gonio/rig/kinematics.h"

namespace gonio::instrument {

/// What one pixel looks at in one pose.
struct PixelGeometry {
  Eigen::Vector3d point_in_sample_mm;  ///< z = 0
  brdf::DirectionPair directions;      ///< sample frame, at that point
  /// V I cos theta_i / r^2 with r in mm (r = 1 for a collimated lamp): the signal of a pixel is
  /// C * f * factor. There is no cos theta_o: a pixel's footprint grows as its inverse.
  double factor = 0.0;
  /// V / (pi r^2) with r from the lamp to the rig's centre: stray light adds C * stray_factor *
  /// StrayLight::fraction to the signal.
  double stray_factor = 0.0;
};

/// What the pixel has to show for a BRDF `f`, over C.
inline double signal_over_constant(const Instrument& instrument, const PixelGeometry& pixel,
                                   double f) {
  return f * pixel.factor + instrument.stray.fraction * pixel.stray_factor;
}

/// Geometry of a pixel; empty when its ray misses the sample plane's front side or the lamp stands
/// behind the plane.
std::optional<PixelGeometry> pixel_geometry(const Instrument& instrument, const rig::RigPose& pose,
                                            double column, double row);

/// Standard deviation of the half vector about the sample's normal, per tangential axis: the
/// normal's own, and what the lamp's direction turns it by. A turn of wi by a small angle in the
/// plane of wi and wo turns h by half of it, one out of it by 1 / (2 cos theta_d) of it.
Angle half_vector_sigma(const Instrument& instrument, Angle theta_d);

/// Pixel that a point of the sample plane falls on; empty behind the camera.
std::optional<Eigen::Vector2d> pixel_of_point(const Instrument& instrument,
                                              const rig::RigPose& pose,
                                              const Eigen::Vector3d& point_in_sample_mm);

}  // namespace gonio::instrument
