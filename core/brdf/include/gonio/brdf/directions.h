#pragma once

#include <Eigen/Core>

#include "gonio/units/angle.h"

namespace gonio::brdf {

/// A pair of directions at the surface.
///
/// Frame    Sample frame: z = surface normal, x = sample mark, right-handed.
/// `wi`     Unit vector leaving the surface towards the light.
/// `wo`     Unit vector leaving the surface towards the detector.
struct DirectionPair {
  Eigen::Vector3d wi;
  Eigen::Vector3d wo;
};

/// Half/difference (Rusinkiewicz) angles of a direction pair.
///
/// Range    theta_h, theta_d in [0, 90] deg; phi_h, phi_d in (-180, 180] deg. At the pole
///          theta_h = 0 the azimuth is undefined and phi_h is 0; at theta_d = 0 phi_d is 0.
struct HalfDiff {
  Angle theta_h;
  Angle theta_d;
  Angle phi_d;
  Angle phi_h;
};

/// Unit vector at polar angle `theta` from the normal and azimuth `phi` from x.
Eigen::Vector3d direction(Angle theta, Angle phi);

/// Converts a direction pair to half/difference angles, the grid MERL is stored on.
///
/// Throws   std::invalid_argument if the norm of either is off 1 by more than 1e-6 or wi = -wo.
///          Directions below the horizon are converted like any other.
/// Source   Rusinkiewicz, "A New Change of Variables for Efficient BRDF Representation",
///          EGWR 1998, section 2; azimuth sign as in Matusik et al. 2003.
HalfDiff half_diff_from_directions(const DirectionPair& pair);

/// The inverse. Exact for every input; the directions may lie below the horizon.
DirectionPair directions_from_half_diff(const HalfDiff& half_diff);

/// The pair seen from a sample whose normal is off: turned about y, then about x of its frame.
DirectionPair tilted(const DirectionPair& pair, Angle about_x, Angle about_y);

/// The pair tilted by `tilt` to either side about x (or y), as far as both directions stay above
/// the horizon: otherwise that end is the pair itself. `steps`: how many tilts lie between them, 0
/// to 2.
struct TiltedEnds {
  DirectionPair plus;
  DirectionPair minus;
  int steps = 0;
};
TiltedEnds tilted_ends(const DirectionPair& pair, Angle tilt, bool about_x);

/// Cosines of the polar angles of light and detector, without building vectors.
struct PolarCosines {
  double cos_theta_i;
  double cos_theta_o;
};
PolarCosines polar_cosines(Angle theta_h, Angle theta_d, Angle phi_d);

/// True when both directions lie above the horizon: |cos phi_d| tan theta_h tan theta_d < 1.
bool above_horizon(Angle theta_h, Angle theta_d, Angle phi_d);

/// `direction` with one of its angles moved by `by`, theta_h and theta_d kept within [0, 90]
/// degrees. Where that would lie below the horizon, `direction` itself.
HalfDiff moved(const HalfDiff& direction, Angle HalfDiff::*angle, Angle by);

}  // namespace gonio::brdf
