#include "gonio/brdf/spectrum.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <string>

namespace gonio::brdf {
namespace {

constexpr double kObserverFirst_nm = 380.0;
constexpr double kObserverStep_nm = 10.0;
constexpr std::size_t kObserverRows = 41;

struct Row {
  double x, y, z;  ///< observer
  double d65;
};

constexpr std::array<Row, kObserverRows> kTable = {{
    {0.0014, 0.0000, 0.0065, 49.9755}, {0.0042, 0.0001, 0.0201, 54.6482},
    {0.0143, 0.0004, 0.0679, 82.7549}, {0.0435, 0.0012, 0.2074, 91.4860},
    {0.1344, 0.0040, 0.6456, 93.4318}, {0.2839, 0.0116, 1.3856, 86.6823},
    {0.3483, 0.0230, 1.7471, 104.865}, {0.3362, 0.0380, 1.7721, 117.008},
    {0.2908, 0.0600, 1.6692, 117.812}, {0.1954, 0.0910, 1.2876, 114.861},
    {0.0956, 0.1390, 0.8130, 115.923}, {0.0320, 0.2080, 0.4652, 108.811},
    {0.0049, 0.3230, 0.2720, 109.354}, {0.0093, 0.5030, 0.1582, 107.802},
    {0.0633, 0.7100, 0.0782, 104.790}, {0.1655, 0.8620, 0.0422, 107.689},
    {0.2904, 0.9540, 0.0203, 104.405}, {0.4334, 0.9950, 0.0087, 104.046},
    {0.5945, 0.9950, 0.0039, 100.000}, {0.7621, 0.9520, 0.0021, 96.3342},
    {0.9163, 0.8700, 0.0017, 95.7880}, {1.0263, 0.7570, 0.0011, 88.6856},
    {1.0622, 0.6310, 0.0008, 90.0062}, {1.0026, 0.5030, 0.0003, 89.5991},
    {0.8544, 0.3810, 0.0002, 87.6987}, {0.6424, 0.2650, 0.0000, 83.2886},
    {0.4479, 0.1750, 0.0000, 83.6992}, {0.2835, 0.1070, 0.0000, 80.0268},
    {0.1649, 0.0610, 0.0000, 80.2146}, {0.0874, 0.0320, 0.0000, 82.2778},
    {0.0468, 0.0170, 0.0000, 78.2842}, {0.0227, 0.0082, 0.0000, 69.7213},
    {0.0114, 0.0041, 0.0000, 71.6091}, {0.0058, 0.0021, 0.0000, 74.3490},
    {0.0029, 0.0010, 0.0000, 61.6040}, {0.0014, 0.0005, 0.0000, 69.8856},
    {0.0007, 0.0003, 0.0000, 75.0870}, {0.0003, 0.0001, 0.0000, 63.5927},
    {0.0002, 0.0001, 0.0000, 46.4182}, {0.0001, 0.0000, 0.0000, 66.8054},
    {0.0000, 0.0000, 0.0000, 63.3828},
}};

/// Observer times illuminant at any wavelength of the table.
Eigen::Vector3d response(double wavelength_nm) {
  const double at = (wavelength_nm - kObserverFirst_nm) / kObserverStep_nm;
  const std::size_t i = std::min(static_cast<std::size_t>(std::fmax(at, 0.0)), kObserverRows - 2);
  const double t = at - static_cast<double>(i);
  const Row& a = kTable[i];
  const Row& b = kTable[i + 1];
  const auto mix = [t](double from, double to) { return from + t * (to - from); };
  return mix(a.d65, b.d65) * Eigen::Vector3d(mix(a.x, b.x), mix(a.y, b.y), mix(a.z, b.z));
}

void check(std::span<const double> wavelengths_nm) {
  const auto fail = [](const std::string& message) { throw std::invalid_argument(message); };
  if (wavelengths_nm.size() < 2) {
    fail("found " + std::to_string(wavelengths_nm.size()) + " wavelengths, expected at least 2");
  }
  for (std::size_t i = 0; i < wavelengths_nm.size(); ++i) {
    if (!(wavelengths_nm[i] >= 200.0 && wavelengths_nm[i] <= 2500.0)) {
      fail("found wavelength " + std::to_string(wavelengths_nm[i]) + " nm, expected 200 to 2500");
    }
    if (i > 0 && !(wavelengths_nm[i] > wavelengths_nm[i - 1])) {
      fail("found wavelength " + std::to_string(wavelengths_nm[i]) +
           " nm not above the one before, expected ascending");
    }
  }
  if (wavelengths_nm.front() > 450.0 || wavelengths_nm.back() < 650.0) {
    fail("found wavelengths from " + std::to_string(wavelengths_nm.front()) + " to " +
         std::to_string(wavelengths_nm.back()) + " nm, expected at least 450 to 650");
  }
}

}  // namespace

Eigen::Matrix3Xd srgb_weights(std::span<const double> wavelengths_nm) {
  check(wavelengths_nm);
  const auto count = static_cast<Eigen::Index>(wavelengths_nm.size());
  Eigen::Matrix3Xd xyz = Eigen::Matrix3Xd::Zero(3, count);
  constexpr int kFineSteps = 400;  // 1 nm; the table's own steps are linear
  for (int i = 0; i <= kFineSteps; ++i) {
    const double at = kObserverFirst_nm + i;
    const double share = i == 0 || i == kFineSteps ? 0.5 : 1.0;
    const auto above = std::upper_bound(wavelengths_nm.begin(), wavelengths_nm.end(), at);
    const auto next = static_cast<Eigen::Index>(above - wavelengths_nm.begin());
    if (next == 0 || next == count) {  // constant beyond the ends
      xyz.col(next == 0 ? 0 : count - 1) += share * response(at);
      continue;
    }
    const double from = wavelengths_nm[static_cast<std::size_t>(next - 1)];
    const double to = wavelengths_nm[static_cast<std::size_t>(next)];
    const double t = (at - from) / (to - from);
    xyz.col(next - 1) += share * (1.0 - t) * response(at);
    xyz.col(next) += share * t * response(at);
  }
  Eigen::Matrix3d rgb_from_xyz;
  rgb_from_xyz << 3.2406, -1.5372, -0.4986,  //
      -0.9689, 1.8758, 0.0415,               //
      0.0557, -0.2040, 1.0570;
  Eigen::Matrix3Xd weights = rgb_from_xyz * xyz;
  for (Eigen::Index channel = 0; channel < 3; ++channel) {
    weights.row(channel) /= weights.row(channel).sum();
  }
  return weights;
}

Eigen::MatrixX3d smooth_spectra(std::span<const double> wavelengths_nm) {
  const Eigen::Matrix3Xd weights = srgb_weights(wavelengths_nm);
  const Eigen::Index n = weights.cols();
  // Least |D s|^2 under weights s = rgb: the stationary point of the Lagrangian.
  Eigen::MatrixXd bend = Eigen::MatrixXd::Zero(std::max<Eigen::Index>(n - 2, 0), n);
  for (Eigen::Index i = 0; i < bend.rows(); ++i) bend.block<1, 3>(i, i) << 1.0, -2.0, 1.0;
  Eigen::MatrixXd system = Eigen::MatrixXd::Zero(n + 3, n + 3);
  system.topLeftCorner(n, n) = bend.transpose() * bend;
  system.topRightCorner(n, 3) = weights.transpose();
  system.bottomLeftCorner(3, n) = weights;
  Eigen::MatrixXd right = Eigen::MatrixXd::Zero(n + 3, 3);
  right.bottomRows(3).setIdentity();
  return system.fullPivLu().solve(right).topRows(n);
}

}  // namespace gonio::brdf
