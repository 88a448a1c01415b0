#include "gonio/brdf/directions.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <string>

#include "sin_cos.h"

namespace gonio::brdf {
namespace {

constexpr double kNormTolerance = 1e-6;

Eigen::Vector3d normalised(const Eigen::Vector3d& v, const char* name) {
  const double norm = v.norm();
  if (!(std::abs(norm - 1.0) <= kNormTolerance)) {  // written so that NaN is refused too
    throw std::invalid_argument("half_diff_from_directions: |" + std::string(name) +
                                "| = " + std::to_string(norm) + ", expected 1 within 1e-6");
  }
  return v / norm;
}

/// atan2 in (-180, 180] deg: its -180 (for y = -0) is the same direction as +180.
Angle azimuth(double y, double x) {
  const double radians = std::atan2(y, x);
  return Angle::from_radians(radians <= -std::numbers::pi ? std::numbers::pi : radians);
}

}  // namespace

Eigen::Vector3d direction(Angle theta, Angle phi) {
  const double sin_theta = sin(theta);
  return {sin_theta * cos(phi), sin_theta * sin(phi), cos(theta)};
}

HalfDiff half_diff_from_directions(const DirectionPair& pair) {
  const Eigen::Vector3d wi = normalised(pair.wi, "wi");
  const Eigen::Vector3d wo = normalised(pair.wo, "wo");
  // For unit vectors sum and difference are perpendicular, of lengths 2 cos and 2 sin theta_d:
  // the tangent keeps all digits at both ends, where an arc cosine loses half of them.
  const Eigen::Vector3d sum = wi + wo;
  const Eigen::Vector3d difference = wi - wo;
  const double sum_norm = sum.norm();
  if (sum_norm == 0.0) {
    throw std::invalid_argument(
        "half_diff_from_directions: wi = -wo has no half vector (theta_d = 90 deg)");
  }
  const Eigen::Vector3d h = sum / sum_norm;

  HalfDiff result;
  const double sin_theta_h = std::hypot(h.x(), h.y());
  result.theta_h = Angle::from_radians(std::atan2(sin_theta_h, h.z()));
  result.theta_d = Angle::from_radians(std::atan2(difference.norm(), sum_norm));
  // Azimuth of h, as cosine and sine; x by convention at the pole.
  double cos_phi_h = 1.0;
  double sin_phi_h = 0.0;
  if (sin_theta_h > 0.0) {
    cos_phi_h = h.x() / sin_theta_h;
    sin_phi_h = h.y() / sin_theta_h;
    result.phi_h = azimuth(h.y(), h.x());
  }
  if (difference.squaredNorm() > 0.0) {
    // Turn the difference by -phi_h about z, then by -theta_h about y.
    const double along = cos_phi_h * difference.x() + sin_phi_h * difference.y();
    const double across = cos_phi_h * difference.y() - sin_phi_h * difference.x();
    result.phi_d = azimuth(across, h.z() * along - sin_theta_h * difference.z());
  }
  return result;
}

DirectionPair directions_from_half_diff(const HalfDiff& half_diff) {
  const double sin_h = sin(half_diff.theta_h);
  const double cos_h = cos(half_diff.theta_h);
  const double sin_p = sin(half_diff.phi_h);
  const double cos_p = cos(half_diff.phi_h);
  const Eigen::Vector3d h(sin_h * cos_p, sin_h * sin_p, cos_h);
  const Eigen::Vector3d x(cos_h * cos_p, cos_h * sin_p, -sin_h);
  const Eigen::Vector3d y(-sin_p, cos_p, 0.0);
  const Eigen::Vector3d half_chord =
      sin(half_diff.theta_d) * (cos(half_diff.phi_d) * x + sin(half_diff.phi_d) * y);
  const Eigen::Vector3d middle = cos(half_diff.theta_d) * h;
  return {middle + half_chord, middle - half_chord};
}

DirectionPair tilted(const DirectionPair& pair, Angle about_x, Angle about_y) {
  const Eigen::Matrix3d turn = (Eigen::AngleAxisd(about_x.radians(), Eigen::Vector3d::UnitX()) *
                                Eigen::AngleAxisd(about_y.radians(), Eigen::Vector3d::UnitY()))
                                   .toRotationMatrix();
  return {turn * pair.wi, turn * pair.wo};
}

TiltedEnds tilted_ends(const DirectionPair& pair, Angle tilt, bool about_x) {
  TiltedEnds ends{pair, pair, 0};
  for (const bool plus : {true, false}) {
    const Angle by = plus ? tilt : -tilt;
    const DirectionPair turned = tilted(pair, about_x ? by : Angle(), about_x ? Angle() : by);
    if (turned.wi.z() <= 0.0 || turned.wo.z() <= 0.0) continue;
    (plus ? ends.plus : ends.minus) = turned;
    ++ends.steps;
  }
  return ends;
}

PolarCosines polar_cosines(Angle theta_h, Angle theta_d, Angle phi_d) {
  const double common = cos(theta_h) * cos(theta_d);
  const double split = sin(theta_h) * sin(theta_d) * cos(phi_d);
  return {common - split, common + split};
}

bool above_horizon(Angle theta_h, Angle theta_d, Angle phi_d) {
  return above_horizon(SinCos(theta_h), SinCos(theta_d), cos(phi_d));
}

HalfDiff moved(const HalfDiff& direction, Angle HalfDiff::*angle, Angle by) {
  HalfDiff there = direction;
  there.*angle += by;
  if (angle != &HalfDiff::phi_d) {
    there.*angle = std::clamp(there.*angle, Angle(), Angle::from_degrees(90.0));
  }
  return above_horizon(there.theta_h, there.theta_d, there.phi_d) ? there : direction;
}

}  // namespace gonio::brdf
