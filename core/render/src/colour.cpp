#include "gonio/render/colour.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>

namespace gonio::render {
namespace {

constexpr double kRadiansPerDegree = std::numbers::pi / 180.0;

/// IEC 61966-2-1, linear sRGB to CIE XYZ.
const Eigen::Matrix3d& xyz_from_srgb() {
  static const Eigen::Matrix3d matrix = (Eigen::Matrix3d() << 0.4124564, 0.3575761, 0.1804375,  //
                                         0.2126729, 0.7151522, 0.0721750,                       //
                                         0.0193339, 0.1191920, 0.9503041)
                                            .finished();
  return matrix;
}

/// Of (1, 1, 1), so that a grey is grey to the last digit.
Eigen::Vector3d white() { return xyz_from_srgb().rowwise().sum(); }

constexpr double kEpsilon = 216.0 / 24389.0;  // CIE 15: (6/29)^3
constexpr double kKappa = 24389.0 / 27.0;

double lab_curve(double t) { return t > kEpsilon ? std::cbrt(t) : (kKappa * t + 16.0) / 116.0; }

double inverse_lab_curve(double f) {
  const double cube = f * f * f;
  return cube > kEpsilon ? cube : (116.0 * f - 16.0) / kKappa;
}

double hue_degrees(double b, double a) {
  if (a == 0.0 && b == 0.0) return 0.0;
  const double angle = std::atan2(b, a) / kRadiansPerDegree;
  return angle < 0.0 ? angle + 360.0 : angle;
}

double pow7(double value) { return std::pow(value, 7.0); }

}  // namespace

Lab lab_from_linear_srgb(const Eigen::Array3d& rgb) {
  const Eigen::Array3d relative = (xyz_from_srgb() * rgb.matrix()).array() / white().array();
  const double fx = lab_curve(relative.x());
  const double fy = lab_curve(relative.y());
  const double fz = lab_curve(relative.z());
  return {116.0 * fy - 16.0, 500.0 * (fx - fy), 200.0 * (fy - fz)};
}

Eigen::Array3d linear_srgb_from_lab(const Lab& lab) {
  static const Eigen::Matrix3d srgb_from_xyz = xyz_from_srgb().inverse();
  const double fy = (lab.x() + 16.0) / 116.0;
  const Eigen::Vector3d xyz(inverse_lab_curve(fy + lab.y() / 500.0) * white().x(),
                            inverse_lab_curve(fy) * white().y(),
                            inverse_lab_curve(fy - lab.z() / 200.0) * white().z());
  return srgb_from_xyz * xyz;
}

double delta_e_2000(const Lab& first, const Lab& second) {
  const double mean_chroma_ab =
      (std::hypot(first.y(), first.z()) + std::hypot(second.y(), second.z())) / 2.0;
  const double ratio = pow7(mean_chroma_ab) / (pow7(mean_chroma_ab) + pow7(25.0));
  const double stretch = 1.5 - 0.5 * std::sqrt(ratio);  // 1 + G

  const double a1 = stretch * first.y();
  const double a2 = stretch * second.y();
  const double chroma1 = std::hypot(a1, first.z());
  const double chroma2 = std::hypot(a2, second.z());
  const double hue1 = hue_degrees(first.z(), a1);
  const double hue2 = hue_degrees(second.z(), a2);
  const bool coloured = chroma1 * chroma2 != 0.0;

  double hue_step = 0.0;
  double mean_hue = hue1 + hue2;
  if (coloured) {
    hue_step = hue2 - hue1;
    if (hue_step > 180.0) hue_step -= 360.0;
    if (hue_step < -180.0) hue_step += 360.0;
    mean_hue /= 2.0;
    if (std::abs(hue1 - hue2) > 180.0) mean_hue += hue1 + hue2 < 360.0 ? 180.0 : -180.0;
  }

  const double dl = second.x() - first.x();
  const double dc = chroma2 - chroma1;
  const double dh =
      2.0 * std::sqrt(chroma1 * chroma2) * std::sin(hue_step / 2.0 * kRadiansPerDegree);

  const double mean_l = (first.x() + second.x()) / 2.0;
  const double mean_c = (chroma1 + chroma2) / 2.0;
  const double t = 1.0 - 0.17 * std::cos((mean_hue - 30.0) * kRadiansPerDegree) +
                   0.24 * std::cos(2.0 * mean_hue * kRadiansPerDegree) +
                   0.32 * std::cos((3.0 * mean_hue + 6.0) * kRadiansPerDegree) -
                   0.20 * std::cos((4.0 * mean_hue - 63.0) * kRadiansPerDegree);
  const double off_middle = (mean_l - 50.0) * (mean_l - 50.0);
  const double sl = 1.0 + 0.015 * off_middle / std::sqrt(20.0 + off_middle);
  const double sc = 1.0 + 0.045 * mean_c;
  const double sh = 1.0 + 0.015 * mean_c * t;

  const double blue = (mean_hue - 275.0) / 25.0;
  const double rotation = -2.0 * std::sqrt(pow7(mean_c) / (pow7(mean_c) + pow7(25.0))) *
                          std::sin(2.0 * 30.0 * std::exp(-blue * blue) * kRadiansPerDegree);

  const double l = dl / sl;
  const double c = dc / sc;
  const double h = dh / sh;
  return std::sqrt(std::max(0.0, l * l + c * c + h * h + rotation * c * h));
}

double srgb_encode(double linear) {
  return linear <= 0.0031308 ? 12.92 * linear : 1.055 * std::pow(linear, 1.0 / 2.4) - 0.055;
}

}  // namespace gonio::render
