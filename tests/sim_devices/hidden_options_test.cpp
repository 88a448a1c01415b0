#include "gonio/sim/hidden_options.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "gonio/rig/kinematics.h"
#include "worlds.h"

namespace gonio::sim {
namespace {

using devices::Target;

constexpr std::uint64_t kSeeds = 50;
constexpr double kRounding_deg = 1e-9;

std::shared_ptr<const brdf::BrdfModel> plain_grey() {
  return std::make_shared<brdf::Lambertian>(brdf::Rgb::Constant(0.5));
}

/// Where the values of one name lie over the seeds.
struct Spread {
  double least = 1e300;
  double most = -1e300;

  void add(double value) {
    least = std::min(least, value);
    most = std::max(most, value);
  }
};

/// Within middle +- half, and using most of it: 100 and more uniform draws leave a tenth of the
/// range free at one end once in 20,000 times.
void expect_fills(const Spread& spread, double middle, double half) {
  EXPECT_GE(spread.least, middle - half * (1.0 + kRounding_deg));
  EXPECT_LE(spread.most, middle + half * (1.0 + kRounding_deg));
  EXPECT_LT(spread.least, middle - 0.7 * half);
  EXPECT_GT(spread.most, middle + 0.7 * half);
}

double degrees_between(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b)) * 180.0 / std::numbers::pi;
}

template <typename Visit>
void over_seeds(Visit&& visit) {
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) visit(hidden_options(plain_grey(), seed));
}

TEST(HiddenOptions, TheRigIsOffByWhatAnAlignmentLeaves) {
  const rig::RigDescription nominal = rig::la2(350.0, 500.0);
  Spread points;
  Spread lamp;
  double worst_axis = 0.0;
  double worst_camera = 0.0;
  over_seeds([&](const SimOptions& world) {
    for (const auto& [chain, plain] : {std::pair(&world.rig.lamp, &nominal.lamp),
                                       std::pair(&world.rig.sample, &nominal.sample)}) {
      for (std::size_t i = 0; i < chain->links.size(); ++i) {
        worst_axis = std::max(
            worst_axis, degrees_between(chain->links[i].direction, plain->links[i].direction));
        for (const double offset : chain->links[i].point_mm) points.add(offset);
      }
    }
    const Eigen::Isometry3d moved = nominal.camera.home_pose.inverse() * world.rig.camera.home_pose;
    worst_camera = std::max(worst_camera, Eigen::AngleAxisd(moved.linear()).angle());
    for (const double offset : moved.translation()) points.add(offset);
    lamp.add(world.rig.lamp.home_pose.translation().x());
    EXPECT_LE(world.rig.lamp.home_pose.translation().tail<2>().cwiseAbs().maxCoeff(), 0.5);
    EXPECT_TRUE(world.rig.sample.home_pose.isApprox(nominal.sample.home_pose));
  });
  expect_fills(points, 0.0, 0.5);
  EXPECT_LE(worst_axis, 0.3);
  EXPECT_GT(worst_axis, 0.2);
  EXPECT_LE(worst_camera * 180.0 / std::numbers::pi, 0.3);
  EXPECT_GT(worst_camera * 180.0 / std::numbers::pi, 0.15);
  EXPECT_GE(lamp.least, 498.0);
  EXPECT_LE(lamp.most, 502.0);
  EXPECT_GT(lamp.most - lamp.least, 2.5);
}

TEST(HiddenOptions, AxesAndMountsAreOff) {
  Spread zero;
  Spread backlash;
  Spread sample;
  Spread others;
  Spread heights;
  over_seeds([&](const SimOptions& world) {
    for (const AxisOptions& axis : world.axes) {
      zero.add(axis.zero_offset.degrees());
      backlash.add(axis.backlash.degrees());
      EXPECT_NEAR(axis.encoder_step.degrees(), 0.001, kRounding_deg);
      EXPECT_NEAR(axis.positioning_sigma.degrees(), 0.002, kRounding_deg);
      EXPECT_EQ(axis.eccentricity_cos, Angle());
    }
    sample.add(world.sample_mount.tilt_about_x.degrees());
    sample.add(world.sample_mount.tilt_about_y.degrees());
    EXPECT_EQ(world.mounts.size(), 5U);
    for (const auto& [target, mount] : world.mounts) {
      others.add(mount.tilt_about_x.degrees());
      others.add(mount.tilt_about_y.degrees());
      heights.add(mount.height_mm);
    }
    others.add(world.white_mount.tilt_about_x.degrees());
  });
  expect_fills(zero, 0.0, 0.5);
  expect_fills(backlash, 0.05, 0.03);
  expect_fills(sample, 0.0, 0.3);
  expect_fills(others, 0.0, 0.05);
  expect_fills(heights, 0.0, 0.02);
}

TEST(HiddenOptions, TheCameraIsOff) {
  Spread focal;
  Spread centre;
  Spread tangential;
  Spread gain;
  Spread corner;
  over_seeds([&](const SimOptions& world) {
    const CameraOptions& camera = world.camera;
    EXPECT_EQ(camera.width_px, 612);
    EXPECT_EQ(camera.height_px, 512);
    focal.add(camera.fx_px / 1381.0);
    centre.add(camera.cx_px - 305.5);
    centre.add(camera.cy_px - 255.5);
    tangential.add(camera.p1);
    tangential.add(camera.p2);
    gain.add(camera.dn_per_electron);
    const double q = (306.0 * 306.0 + 256.0 * 256.0) / (1381.0 * 1381.0);
    corner.add(1.0 - (1.0 + camera.vignetting[0] * q + camera.vignetting[1] * q * q));
    EXPECT_NEAR(camera.k1, -0.12, 0.012);
    EXPECT_NEAR(camera.k2, 0.05, 0.005);
    EXPECT_NEAR(camera.read_noise_e, 2.4, 0.12);
    EXPECT_NEAR(camera.full_well_e, 10500.0, 525.0);
    EXPECT_NEAR(camera.dsnu_e, 1.2, 0.06);
    EXPECT_NEAR(camera.prnu, 0.006, 0.0003);
    EXPECT_NEAR(camera.dark_current_e_per_s, 5.0, 0.5);
    EXPECT_EQ(camera.hot_pixel_fraction, 0.0002);
    EXPECT_NEAR(camera.psf_sigma_px, 0.6, 0.05);
    EXPECT_NEAR(camera.nonlinearity, 0.003, 0.0005);
    EXPECT_NEAR(static_cast<double>(camera.shutter_offset.count()), 3000.0, 500.0);
  });
  expect_fills(focal, 1.0, 0.005);
  expect_fills(centre, 0.0, 2.0);
  expect_fills(tangential, 0.0, 4e-4);
  expect_fills(gain, 0.39, 0.39 * 0.03);
  expect_fills(corner, 0.15, 0.01);
}

TEST(HiddenOptions, TheLampIsUneven) {
  Spread warm_up;
  over_seeds([&](const SimOptions& world) {
    const LampOptions& lamp = world.lamp;
    Spread field;
    for (double x = -0.054; x < 0.055; x += 0.009) {
      for (double y = -0.054; y < 0.055; y += 0.009) {
        const auto& c = lamp.field;
        field.add(1.0 + c[0] * x + c[1] * y + c[2] * x * x + c[3] * x * y + c[4] * y * y);
      }
    }
    EXPECT_NEAR(field.most - field.least, 0.08, 0.0085);
    warm_up.add(lamp.warm_up_amplitude);
    EXPECT_EQ(lamp.on_before, 0s);
    EXPECT_EQ(lamp.drift_sigma, 0.001);
    EXPECT_NEAR(lamp.stray_fraction, 0.0005, 0.00005);
  });
  expect_fills(warm_up, 0.01, 0.002);
}

TEST(HiddenOptions, AreAFunctionOfTheSeed) {
  const SimOptions one = hidden_options(plain_grey(), 7);
  const SimOptions same = hidden_options(plain_grey(), 7);
  const SimOptions other = hidden_options(plain_grey(), 8);
  const auto values = [](const SimOptions& world) {
    return std::vector<double>{world.rig.lamp.links[0].direction.x(),
                               world.rig.sample.links[0].point_mm.z(),
                               world.rig.sample.links[1].direction.z(),
                               world.rig.camera.home_pose(0, 1),
                               world.rig.lamp.home_pose(0, 3),
                               world.axes[0].zero_offset.radians(),
                               world.axes[2].backlash.radians(),
                               world.camera.fx_px,
                               world.camera.k1,
                               world.camera.dn_per_electron,
                               world.camera.vignetting[0],
                               world.lamp.field[3],
                               world.lamp.channels[1].intensity_w_per_sr[1],
                               world.mounts.at(Target::mirror).tilt_about_y.radians()};
  };
  EXPECT_EQ(values(one), values(same));
  const auto drawn = values(one);
  const auto changed = values(other);
  for (std::size_t i = 0; i < drawn.size(); ++i) EXPECT_NE(drawn[i], changed[i]) << i;
  EXPECT_THROW(hidden_options(nullptr, 7), std::invalid_argument);
}

TEST(HiddenOptions, FullSizeSeesTheSameField) {
  const CameraOptions small = hidden_options(plain_grey(), 3).camera;
  const CameraOptions full = hidden_options(plain_grey(), 3, HiddenImage::full_size).camera;
  EXPECT_EQ(full.width_px, 2448);
  EXPECT_EQ(full.height_px, 2048);
  EXPECT_NEAR(full.width_px / full.fx_px, small.width_px / small.fx_px, 1e-4);
  EXPECT_NEAR(full.cx_px - 1223.5, 4.0 * (small.cx_px - 305.5), 1e-6);
  EXPECT_EQ(full.k1, small.k1);
}

TEST(HiddenWhite, IsReciprocalAndOneAtTheReferencePoses) {
  const WhiteCertificate white = hidden_white();
  const AngularFactor& table = white.angular;
  const std::size_t thetas = table.theta_i.size();
  const std::size_t phis = table.delta_phi.size();
  ASSERT_EQ(table.theta_o.size(), thetas);
  const auto at = [&](std::size_t i, std::size_t o, std::size_t p) {
    return table.factor[(i * thetas + o) * phis + p];
  };
  for (std::size_t i = 0; i < thetas; ++i) {
    for (std::size_t o = 0; o < thetas; ++o) {
      for (std::size_t p = 0; p < phis; ++p) EXPECT_EQ(at(i, o, p), at(o, i, p));
    }
  }
  const auto node = [&](double deg) {
    const auto found = std::find_if(table.theta_i.begin(), table.theta_i.end(), [&](Angle theta) {
      return std::abs(theta.degrees() - deg) < kRounding_deg;
    });
    return static_cast<std::size_t>(found - table.theta_i.begin());
  };
  ASSERT_LT(node(45.0), thetas);
  EXPECT_EQ(at(node(0.0), node(45.0), 3), 1.0);
  EXPECT_EQ(at(node(0.0), node(15.0), 0), 1.0);
  EXPECT_NEAR(at(node(80.0), node(80.0), 0) / at(node(80.0), node(80.0), 3), 1.05, 0.005);
  EXPECT_NEAR(at(node(80.0), node(80.0), phis - 1) / at(node(80.0), node(80.0), 3), 1.05, 0.005);
  EXPECT_LT(at(node(75.0), node(0.0), 0), 0.98);
  EXPECT_LT(at(node(85.0), node(0.0), 0), at(node(75.0), node(0.0), 0));
}

// --- what the camera sees of it ---

constexpr double kDotMm = 3.0;

/// The board's only mark, a black square, as a camera of the world sees its centre.
SimOptions with_mark(SimOptions world) {
  world.scene.white_patch = false;
  BoardOptions& board = world.scene.board;
  board.columns = board.rows = 1;
  board.white = {false};
  board.cell_mm = kDotMm;
  board.x_mm = 11.0;
  board.y_mm = -7.0;
  board.margin_mm = 10.0;
  return world;
}

/// Brown's model and the chains; nothing of the simulator.
Eigen::Vector2d projected(const SimOptions& world, const rig::Joints& joints) {
  const rig::RigPose pose = rig::forward(world.rig, joints);
  MountOptions mount;
  if (world.mounts.contains(Target::board)) mount = world.mounts.at(Target::board);
  const Eigen::Matrix3d turn =
      (Eigen::AngleAxisd(mount.tilt_about_x.radians(), Eigen::Vector3d::UnitX()) *
       Eigen::AngleAxisd(mount.tilt_about_y.radians(), Eigen::Vector3d::UnitY()))
          .toRotationMatrix();
  const Eigen::Vector3d on_holder = turn * Eigen::Vector3d(11.0, -7.0, mount.height_mm);
  const Eigen::Vector3d seen =
      pose.world_from_camera.inverse() * (pose.world_from_sample * on_holder);
  const double x = seen.x() / seen.z();
  const double y = seen.y() / seen.z();
  const double r2 = x * x + y * y;
  const CameraOptions& camera = world.camera;
  const double radial = 1.0 + camera.k1 * r2 + camera.k2 * r2 * r2;
  return {camera.cx_px + camera.fx_px * (x * radial + 2.0 * camera.p1 * x * y +
                                         camera.p2 * (r2 + 2.0 * x * x)),
          camera.cy_px + camera.fy_px * (y * radial + camera.p1 * (r2 + 2.0 * y * y) +
                                         2.0 * camera.p2 * x * y)};
}

struct Seen {
  Eigen::Vector2d mark_px;
  rig::Joints joints;
};

/// Centroid of what is dark about the middle of a board that is white.
Seen mark_in_picture(const SimOptions& world, const std::vector<Angle>& joints) {
  SimGoniometer rig(world);
  home(rig);
  rig.target_changer().mount(Target::board);
  const devices::Frame frame = picture(rig, joints, 20ms);
  const Eigen::Vector2d about = projected(world, joints);  // to 10 px
  constexpr int kReach = 19;
  const int column = static_cast<int>(about.x());
  const int row = static_cast<int>(about.y());
  const double white = 0.5 * (frame.at(row, column - kReach) + frame.at(row, column + kReach));
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  double weight = 0.0;
  for (int r = row - kReach; r <= row + kReach; ++r) {
    for (int c = column - kReach; c <= column + kReach; ++c) {
      const double dark = 1.0 - frame.at(r, c) / white;
      if (dark < 0.1) continue;  // shading and noise
      sum += dark * Eigen::Vector2d(c, r);
      weight += dark;
    }
  }
  return {sum / weight, rig.true_joints()};
}

TEST(HiddenOptions, TheBoardIsSeenWhereTheHiddenTruthPutsIt) {
  SimOptions plain = nominal_options(plain_grey(), 1);
  plain.camera.width_px = 612;
  plain.camera.height_px = 512;
  plain.camera.cx_px = 305.5;
  plain.camera.cy_px = 255.5;
  plain = with_mark(plain);
  const std::vector<Angle> joints{40.0_deg, 12.0_deg, 8.0_deg};
  const Seen nominal = mark_in_picture(plain, joints);
  // The centroid is lost to noise of 1 % a pixel and to the square's own perspective.
  constexpr double kTolerancePx = 0.06;
  EXPECT_LT((nominal.mark_px - projected(plain, joints)).norm(), kTolerancePx);
  for (const std::uint64_t seed : {1U, 2U, 3U}) {
    const SimOptions world = with_mark(hidden_options(plain_grey(), seed));
    const Seen hidden = mark_in_picture(world, joints);
    const Eigen::Vector2d shift = hidden.mark_px - nominal.mark_px;
    const Eigen::Vector2d told = projected(world, hidden.joints) - projected(plain, joints);
    EXPECT_LT((shift - told).norm(), 2.0 * kTolerancePx) << seed;
    EXPECT_GT(shift.norm(), 0.5) << seed;
    for (std::size_t axis = 0; axis < joints.size(); ++axis) {
      const Angle off = hidden.joints[axis] - joints[axis] - world.axes[axis].zero_offset;
      // Half the play, homing and positioning at five sigma.
      EXPECT_LT(std::abs(off.degrees()), 0.04 + 0.014 + 0.001) << seed << ", axis " << axis;
    }
  }
}

}  // namespace
}  // namespace gonio::sim
