#include <algorithm>
#include <cmath>
#include <numbers>
#include <span>
#include <stdexcept>
#include <string>
#include <utility>

#include "bilinear_warp.h"
#include "gonio/brdf/rgl_file.h"

namespace gonio::brdf {
namespace {

/// Single precision cannot hold pi/2 exactly; files say 89.99999 or 90.000003 deg.
constexpr float kMostTheta = static_cast<float>(std::numbers::pi / 2.0) + 1e-5f;

/// No table of a material comes near; beyond it products leave single precision.
constexpr float kLargestTabulated = 1e12f;

void require(bool fine, const char* field, const std::string& message) {
  if (!fine) throw std::invalid_argument(std::string(field) + ": " + message);
}

void check_grid(const RglTables::Grid& grid, const char* name, std::size_t planes) {
  require(grid.height >= 2 && grid.width >= 2, name,
          "found " + std::to_string(grid.height) + " x " + std::to_string(grid.width) +
              " nodes, expected at least 2 x 2");
  require(grid.values.size() / grid.height / grid.width == planes &&
              grid.values.size() == planes * grid.height * grid.width,
          name,
          "found " + std::to_string(grid.values.size()) + " values, expected " +
              std::to_string(planes) + " planes of " + std::to_string(grid.height) + " x " +
              std::to_string(grid.width));
  require(std::all_of(grid.values.begin(), grid.values.end(),
                      [](float value) { return std::isfinite(value); }),
          name, "found a value that is not finite");
  const auto large = std::find_if(grid.values.begin(), grid.values.end(),
                                  [](float value) { return std::abs(value) > kLargestTabulated; });
  if (large != grid.values.end()) {
    require(false, name, "found " + std::to_string(*large) + ", expected at most 1e12 in size");
  }
}

void check(const RglTables& tables) {
  const std::vector<float>& theta = tables.theta_i_rad;
  require(theta.size() >= 2, "theta_i",
          "found " + std::to_string(theta.size()) + " angles, expected at least 2");
  for (std::size_t i = 0; i < theta.size(); ++i) {
    require(theta[i] >= 0.0f && theta[i] <= kMostTheta, "theta_i",
            "found angle " + std::to_string(i) + " = " + std::to_string(theta[i]) +
                " rad, expected 0 to pi/2");
    require(i == 0 || theta[i] > theta[i - 1], "theta_i",
            "found angle " + std::to_string(i) + " not above the one before, expected ascending");
  }
  check_grid(tables.ndf, "ndf", 1);
  check_grid(tables.sigma, "sigma", 1);
  check_grid(tables.vndf, "vndf", theta.size());
  check_grid(tables.rgb, "rgb", 3 * theta.size());
  const auto smallest = [](const RglTables::Grid& grid) {
    return *std::min_element(grid.values.begin(), grid.values.end());
  };
  require(smallest(tables.ndf) >= 0.0f, "ndf", "found a negative value");
  require(smallest(tables.sigma) > 0.0f, "sigma", "found a value that is not above 0");
  require(std::any_of(tables.rgb.values.begin(), tables.rgb.values.end(),
                      [](float value) { return value > 0.0f; }),
          "rgb", "found no value above 0, expected at least one");
}

BilinearWarp warp_of(RglTables::Grid&& vndf, std::size_t slices) {
  try {
    return {std::move(vndf.values), slices, vndf.height, vndf.width};
  } catch (const std::invalid_argument& error) {
    throw std::invalid_argument(std::string("vndf: ") + error.what());
  }
}

double unit_from_theta(double theta) { return std::sqrt(2.0 * theta / std::numbers::pi); }

}  // namespace

struct RglBrdf::Prepared {
  explicit Prepared(RglTables&& tables)
      : theta_i(std::move(tables.theta_i_rad)),
        ndf(std::move(tables.ndf)),
        sigma(std::move(tables.sigma)),
        rgb(std::move(tables.rgb)),
        vndf(warp_of(std::move(tables.vndf), theta_i.size())),
        jacobian(tables.jacobian) {}

  std::vector<float> theta_i;
  RglTables::Grid ndf;
  RglTables::Grid sigma;
  RglTables::Grid rgb;
  BilinearWarp vndf;
  bool jacobian;
};

RglBrdf::RglBrdf(RglTables tables) {
  check(tables);
  prepared_ = std::make_unique<const Prepared>(std::move(tables));
}

RglBrdf::~RglBrdf() = default;

Rgb RglBrdf::f_cos(const DirectionPair& pair) const {
  const Prepared& p = *prepared_;
  const Eigen::Vector3d& wi = pair.wi;
  const Eigen::Vector3d half = wi + pair.wo;
  const double theta_i = std::atan2(std::hypot(wi.x(), wi.y()), wi.z());
  const double theta_m = std::atan2(std::hypot(half.x(), half.y()), half.z());
  // Azimuth of the half vector from that of the light, without taking either: at the poles the
  // quotient is 0/0, where atan2 gives the 0 that serves as well as any other.
  const double phi =
      std::atan2(wi.x() * half.y() - wi.y() * half.x(), wi.x() * half.x() + wi.y() * half.y());
  // Light from the normal has no azimuth: the half vector's own is taken, as for phi_i = 0.
  const bool from_normal = wi.x() == 0.0 && wi.y() == 0.0;
  const double azimuth = from_normal ? std::atan2(half.y(), half.x()) : phi;
  const BilinearWarp::Point at{unit_from_theta(theta_m),
                               (azimuth + std::numbers::pi) / (2.0 * std::numbers::pi)};

  const auto above =
      std::upper_bound(p.theta_i.begin(), p.theta_i.end(), static_cast<float>(theta_i));
  const std::size_t slice =
      std::min(static_cast<std::size_t>(std::max<std::ptrdiff_t>(above - p.theta_i.begin() - 1, 0)),
               p.theta_i.size() - 2);
  const double from = p.theta_i[slice];
  const double to = p.theta_i[slice + 1];
  const double fraction = std::fmin(std::fmax((theta_i - from) / (to - from), 0.0), 1.0);

  const BilinearWarp::Point uniform = p.vndf.to_uniform(at, slice, fraction);
  const AxisPlace x = AxisPlace::on(uniform.x, p.rgb.width);
  const AxisPlace y = AxisPlace::on(uniform.y, p.rgb.height);
  const std::size_t plane = p.rgb.height * p.rgb.width;
  const std::span<const float> values(p.rgb.values);
  Rgb result;
  for (std::size_t channel = 0; channel < 3; ++channel) {
    const double lower =
        bilinear(values.subspan((3 * slice + channel) * plane, plane), p.rgb.width, x, y);
    const double upper =
        bilinear(values.subspan((3 * slice + 3 + channel) * plane, plane), p.rgb.width, x, y);
    result[static_cast<Eigen::Index>(channel)] = std::fmax(lower + fraction * (upper - lower), 0.0);
  }
  if (!p.jacobian) return result;
  const double ndf = bilinear(p.ndf.values, p.ndf.width, AxisPlace::on(at.x, p.ndf.width),
                              AxisPlace::on(at.y, p.ndf.height));
  // An isotropic material's sigma does not depend on the azimuth: that of the light is 0 here.
  const double sigma = bilinear(p.sigma.values, p.sigma.width,
                                AxisPlace::on(unit_from_theta(theta_i), p.sigma.width),
                                AxisPlace::on(0.5, p.sigma.height));
  return result * (ndf / (4.0 * sigma));
}

Rgb RglBrdf::one_way(const DirectionPair& pair) const {
  if (pair.wi.z() <= 0.0 || pair.wo.z() <= 0.0) return Rgb::Zero();
  return f_cos(pair) / pair.wo.z();
}

Rgb RglBrdf::evaluate(const DirectionPair& pair) const {
  if (pair.wi.z() <= 0.0 || pair.wo.z() <= 0.0) return Rgb::Zero();
  return (f_cos(pair) + f_cos({pair.wo, pair.wi})) / (pair.wi.z() + pair.wo.z());
}

}  // namespace gonio::brdf
