#include "gonio/sim/hidden_options.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <string_view>
#include <utility>
#include <vector>

#include "gonio/random/distributions.h"

namespace gonio::sim {
namespace {

using namespace std::chrono_literals;

constexpr double kAxisDeg = 0.3;  // about any direction
constexpr double kPointMm = 0.5;
constexpr double kLampMm = 2.0;

/// Draws by name, so that one more changes no other.
class Draw {
 public:
  explicit Draw(std::uint64_t seed) : seed_(seed) {}

  /// Uniform on middle +- half; `index` tells several of one name apart.
  double operator()(std::string_view name, double middle, double half,
                    std::uint64_t index = 0) const {
    const random::Key key = random::make_key(seed_, fmt::format("hidden.{}", name));
    return middle + half * (2.0 * random::uniform(key, index) - 1.0);
  }
  Angle angle(std::string_view name, double middle_deg, double half_deg,
              std::uint64_t index = 0) const {
    return Angle::from_degrees((*this)(name, middle_deg, half_deg, index));
  }
  Eigen::Vector3d vector(std::string_view name, double half) const {
    return {(*this)(name, 0.0, half, 0), (*this)(name, 0.0, half, 1), (*this)(name, 0.0, half, 2)};
  }

 private:
  std::uint64_t seed_;
};

Eigen::Matrix3d rotation(const Eigen::Vector3d& vector_deg) {
  const Angle angle = Angle::from_degrees(vector_deg.norm());
  return Eigen::AngleAxisd(angle.radians(), vector_deg.normalized()).toRotationMatrix();
}

void misalign(rig::ChainLink& link, std::string_view name, const Draw& draw) {
  // Two angles at right angles to each other and to the axis stay within the whole.
  const double half_deg = kAxisDeg * std::sqrt(0.5);
  const Eigen::Vector3d across = link.direction.unitOrthogonal();
  const Eigen::Vector3d other = link.direction.cross(across);
  const auto direction = fmt::format("{}.direction", name);
  link.direction = (rotation(draw(direction, 0.0, half_deg, 0) * across +
                             draw(direction, 0.0, half_deg, 1) * other) *
                    link.direction)
                       .normalized();
  link.point_mm += draw.vector(fmt::format("{}.point", name), kPointMm);
}

void misalign(Eigen::Isometry3d& world_from_tip, std::string_view name, const Draw& draw) {
  const double half_deg = kAxisDeg * std::sqrt(1.0 / 3.0);
  world_from_tip.rotate(rotation(draw.vector(fmt::format("{}.turn", name), half_deg)));
  world_from_tip.pretranslate(draw.vector(fmt::format("{}.place", name), kPointMm));
}

rig::RigDescription misaligned_rig(const Draw& draw) {
  rig::RigDescription rig = rig::la2(350.0, 500.0 + draw("lamp.distance", 0.0, kLampMm - kPointMm));
  misalign(rig.camera.home_pose, "camera", draw);
  misalign(rig.lamp.home_pose, "lamp", draw);
  for (rig::Chain* chain : {&rig.lamp, &rig.sample}) {
    for (rig::ChainLink& link : chain->links) misalign(link, rig.axes[link.axis].name, draw);
  }
  return rig;
}

AxisOptions hidden_axis(std::size_t axis, const Draw& draw) {
  AxisOptions options;
  options.zero_offset = draw.angle("zero", 0.0, 0.5, axis);
  options.backlash = draw.angle("backlash", 0.05, 0.03, axis);
  options.homing_sigma = Angle::from_degrees(0.002);
  options.positioning_sigma = Angle::from_degrees(0.002);
  return options;
}

MountOptions hidden_mount(devices::Target target, double tilt_deg, const Draw& draw) {
  const auto name = fmt::format("mount.{}", devices::to_string(target));
  return {draw.angle(name, 0.0, tilt_deg, 0), draw.angle(name, 0.0, tilt_deg, 1),
          draw(name, 0.0, 0.02, 2)};
}

CameraOptions hidden_camera(HiddenImage image, const Draw& draw) {
  const bool full = image == HiddenImage::full_size;
  CameraOptions camera;
  camera.width_px = full ? 2448 : 612;
  camera.height_px = full ? 2048 : 512;
  const double nominal_f_px = full ? 5525.0 : 1381.0;
  camera.fx_px = camera.fy_px = nominal_f_px * draw("focal_length", 1.0, 0.005);
  const double centre_px = 8.0 * camera.width_px / 2448.0;
  camera.cx_px = draw("centre", 0.5 * (camera.width_px - 1), centre_px, 0);
  camera.cy_px = draw("centre", 0.5 * (camera.height_px - 1), centre_px, 1);
  camera.k1 = -0.12 * draw("k1", 1.0, 0.1);
  camera.k2 = 0.05 * draw("k2", 1.0, 0.1);
  camera.p1 = draw("p", 0.0, 4e-4, 0);
  camera.p2 = draw("p", 0.0, 4e-4, 1);

  camera.responsivity_e_per_s *= draw("responsivity", 1.0, 0.05);
  camera.dn_per_electron = 0.39 * draw("gain", 1.0, 0.03);
  camera.read_noise_e = 2.4 * draw("read_noise", 1.0, 0.05);
  camera.full_well_e = 10500.0 * draw("full_well", 1.0, 0.05);
  camera.dark_current_e_per_s = 5.0 * draw("dark_current", 1.0, 0.1);
  camera.hot_pixel_fraction = 0.0002;
  camera.prnu = 0.006 * draw("prnu", 1.0, 0.05);
  camera.dsnu_e = 1.2 * draw("dsnu", 1.0, 0.05);

  const double half_width = 0.5 * camera.width_px / nominal_f_px;
  const double half_height = 0.5 * camera.height_px / nominal_f_px;
  const double corner = half_width * half_width + half_height * half_height;
  const double curve = draw("vignetting.curve", 0.0, 0.5);
  camera.vignetting = {-draw("vignetting.corner", 0.15, 0.01) / corner - curve * corner, curve,
                       0.0};
  camera.psf_sigma_px = draw("psf", 0.6, 0.05);
  camera.nonlinearity = draw("nonlinearity", 0.003, 0.0005);
  camera.shutter_offset =
      std::chrono::nanoseconds(std::llround(draw("shutter_offset", 3000.0, 500.0)));
  return camera;
}

LampOptions hidden_lamp(double sample_half_width_mm, const Draw& draw) {
  LampOptions lamp;
  for (std::size_t i = 0; i < lamp.channels.size(); ++i) {
    lamp.channels[i].intensity_w_per_sr *= draw("lamp.intensity", 1.0, 0.1, i);
  }
  const double edge = sample_half_width_mm / 500.0;  // tangent of the angle from the lamp's axis
  const double bend = -0.08 / (2.0 * edge * edge);   // both coordinates reach it in the corner
  lamp.field = {draw("lamp.field", 0.0, 0.03, 0), draw("lamp.field", 0.0, 0.03, 1),
                bend * draw("lamp.field", 1.0, 0.05, 2), draw("lamp.field", 0.0, 0.3, 3),
                bend * draw("lamp.field", 1.0, 0.05, 4)};
  lamp.warm_up_amplitude = draw("lamp.warm_up", 0.01, 0.002);
  lamp.warm_up_tau = std::chrono::seconds(std::llround(draw("lamp.warm_up_tau", 600.0, 60.0)));
  lamp.on_before = 0s;
  lamp.drift_sigma = 0.001;
  lamp.drift_tau = 600s;
  lamp.stray_fraction = draw("lamp.stray", 0.0005, 0.00005);
  return lamp;
}

}  // namespace

WhiteCertificate hidden_white() {
  WhiteCertificate white;
  white.reflectance = {0.99, 0.985, 0.98};
  white.u_relative = 0.005;
  AngularFactor& table = white.angular;
  for (const double theta : {0.0, 15.0, 30.0, 45.0, 60.0, 70.0, 75.0, 80.0, 85.0}) {
    table.theta_i.push_back(Angle::from_degrees(theta));
  }
  table.theta_o = table.theta_i;
  for (const double phi : {0.0, 30.0, 60.0, 90.0, 120.0, 150.0, 180.0}) {
    table.delta_phi.push_back(Angle::from_degrees(phi));
  }
  const auto fall = [](Angle theta) {  // 10 % at 85 deg
    const double beyond = std::max(0.0, (theta.degrees() - 60.0) / 25.0);
    return 1.0 - 0.1 * beyond * beyond;
  };
  // The same with light and detector exchanged: a product of one function of each, and a ridge of
  // 5 % in the plane of incidence that vanishes where one of them stands on the normal.
  for (const Angle theta_i : table.theta_i) {
    for (const Angle theta_o : table.theta_o) {
      for (const Angle delta_phi : table.delta_phi) {
        const double grazing =
            std::pow(std::sin(theta_i.radians()) * std::sin(theta_o.radians()), 2);
        const double in_plane = std::pow(std::cos(delta_phi.radians()), 2);
        table.factor.push_back(fall(theta_i) * fall(theta_o) * (1.0 + 0.05 * grazing * in_plane));
      }
    }
  }
  return white;
}

std::vector<brdf::Rgb> hidden_chart() {
  std::vector<brdf::Rgb> albedos;
  for (int grey = 0; grey < 6; ++grey) albedos.push_back(brdf::Rgb::Constant(0.9 / (1 << grey)));
  for (const double dim : {0.05, 0.15, 0.3}) {
    for (int mask = 1; mask < 7; ++mask) {  // red, green, yellow, blue, magenta, cyan
      albedos.emplace_back((mask & 1) != 0 ? 0.6 : dim, (mask & 2) != 0 ? 0.6 : dim,
                           (mask & 4) != 0 ? 0.6 : dim);
    }
  }
  return albedos;
}

SimOptions hidden_options(std::shared_ptr<const brdf::BrdfModel> material, std::uint64_t seed,
                          HiddenImage image) {
  using devices::Target;
  const Draw draw(seed);
  SimOptions options;
  options.rig = misaligned_rig(draw);
  for (std::size_t axis = 0; axis < options.rig.axes.size(); ++axis) {
    options.axes.push_back(hidden_axis(axis, draw));
  }
  options.sample_mount = hidden_mount(Target::sample, 0.3, draw);
  options.white_mount = hidden_mount(Target::white, 0.05, draw);
  for (const Target target : {Target::board, Target::mirror, Target::black_trap,
                              Target::black_glass, Target::colour_chart}) {
    options.mounts[target] = hidden_mount(target, 0.05, draw);
  }
  options.camera = hidden_camera(image, draw);
  options.scene.sample = std::move(material);
  options.lamp = hidden_lamp(options.scene.sample_half_width_mm, draw);
  const WhiteCertificate white = hidden_white();
  options.scene.white_tile = std::make_shared<AngularWhite>(white.reflectance, white.angular);
  options.scene.patch = options.scene.white_tile;
  options.scene.black_glass.filter = 0.02;
  options.scene.black_trap_albedo = 0.0001;  // well below the stray light that it is to show
  options.scene.colour_chart.albedos = hidden_chart();
  options.seed = seed;
  options.validate();
  return options;
}

}  // namespace gonio::sim
