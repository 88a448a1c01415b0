#include "gonio/setup/simulated_rig.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <string>

#include "gonio/brdf/diffuse_models.h"
#include "gonio/errors/errors.h"
#include "gonio/sim/hidden_options.h"
#include "temporary_folder.h"

namespace gonio::cli {
namespace {

using testing::HasSubstr;

std::shared_ptr<const brdf::BrdfModel> grey_plate() {
  return std::make_shared<brdf::Lambertian>(brdf::Rgb::Constant(0.5));
}

brdf::DirectionPair directions(double theta_i_deg, double theta_o_deg, double delta_phi_deg) {
  constexpr double kDeg = std::numbers::pi / 180.0;
  const double i = theta_i_deg * kDeg;
  const double o = theta_o_deg * kDeg;
  const double phi = delta_phi_deg * kDeg;
  return {{std::sin(i), 0.0, std::cos(i)},
          {std::sin(o) * std::cos(phi), std::sin(o) * std::sin(phi), std::cos(o)}};
}

/// The simulated tile and what the operator knows of it: two pieces of code that share nothing.
void expect_known(const sim::SimOptions& world, const instrument::Instrument& known) {
  for (const auto& pair : {directions(0, 45, 0), directions(45, 8, 77), directions(33, 66, 10),
                           directions(78, 79, 175), directions(84, 20, 120)}) {
    const brdf::Rgb seen = world.scene.white_tile->evaluate(pair);
    const brdf::Rgb told = instrument::white_brdf(known.white, pair);
    EXPECT_LT((seen - told).abs().maxCoeff(), 1e-9);
  }
}

RigFile hidden_file(const std::string& more = "") {
  return rig_file_from_text(more + "[simulation]\nhidden = true\n", "rig.toml");
}

TEST(SimulatedWorld, HasTheTileOfTheCertificate) {
  const TemporaryFolder folder;
  folder.write("tile.csv",
               "theta_i_deg,theta_o_deg,delta_phi_deg,factor\n"
               "0,0,0,1.0\n0,80,0,0.9\n0,0,180,1.0\n0,80,180,0.9\n"
               "80,0,0,0.9\n80,80,0,0.85\n80,0,180,0.9\n80,80,180,0.95\n");
  const auto path = folder.write(
      "rig.toml", "[white]\nreflectance = [0.9, 0.8, 0.7]\ncertificate = \"tile.csv\"\n");
  const RigFile file = read_rig_file(path);
  const instrument::Instrument known = nominal_instrument(file);
  EXPECT_NEAR(instrument::white_brdf(known.white, directions(80, 40, 180))[1],
              0.8 * 0.925 / std::numbers::pi, 1e-12);
  expect_known(simulated_world(file, grey_plate(), 1), known);
  EXPECT_THAT(rig_file_text(file, false), HasSubstr("certificate = \"tile.csv\""));
}

TEST(SimulatedWorld, PolarisesWhereTheFileSaysSo) {
  const std::string keys =
      "lamp_polarisation = 0.8\nlamp_polarisation_deg = 30\n"
      "camera_polarisation = 0.5\ncamera_polarisation_deg = -20\n";
  for (const std::string hidden : {"", "hidden = true\n"}) {
    const RigFile file = rig_file_from_text("[simulation]\n" + hidden + keys, "rig.toml");
    const sim::SimOptions world = simulated_world(file, grey_plate(), 1);
    EXPECT_EQ(world.lamp.polarisation, 0.8);
    EXPECT_NEAR(world.lamp.polarisation_direction.degrees(), 30.0, 1e-12);
    EXPECT_EQ(world.camera.polarisation, 0.5);
    EXPECT_NEAR(world.camera.polarisation_direction.degrees(), -20.0, 1e-12);
  }
}

TEST(SimulatedWorld, NamesACertificateThatIsNone) {
  const TemporaryFolder folder;
  const auto rig = folder.write("rig.toml", "[white]\ncertificate = \"tile.csv\"\n");
  EXPECT_THROW(nominal_instrument(read_rig_file(rig)), FileError);
  folder.write("tile.csv", "theta_i_deg,theta_o_deg,delta_phi_deg,factor\n0,0,0,white\n");
  try {
    nominal_instrument(read_rig_file(rig));
    FAIL() << "accepted";
  } catch (const DataFormatError& error) {
    EXPECT_THAT(error.what(), testing::AllOf(HasSubstr("tile.csv"), HasSubstr("line 2")));
  }
}

TEST(SimulatedWorld, WithoutHiddenIsTheNominalRig) {
  const RigFile file = default_rig_file();
  const sim::SimOptions world = simulated_world(file, grey_plate(), 5);
  const sim::SimOptions nominal = sim::nominal_options(grey_plate(), 5);
  EXPECT_TRUE(world.rig.lamp.home_pose.isApprox(nominal.rig.lamp.home_pose, 0.0));
  EXPECT_EQ(world.sample_mount.tilt_about_x.radians(), nominal.sample_mount.tilt_about_x.radians());
  EXPECT_EQ(world.camera.fx_px, nominal.camera.fx_px);
  EXPECT_EQ(world.axes.at(1).zero_offset, Angle());
}

TEST(SimulatedWorld, HiddenIsOffWhatTheOperatorKnows) {
  const RigFile file = hidden_file();
  const instrument::Instrument known = nominal_instrument(file);
  const sim::SimOptions world = simulated_world(file, grey_plate(), 5);
  world.validate();
  const sim::SimOptions drawn = sim::hidden_options(grey_plate(), 5);
  EXPECT_EQ(known.camera.fx_px, 1381.0);
  EXPECT_EQ(known.rig.sample.links.at(0).direction, Eigen::Vector3d::UnitZ());
  EXPECT_EQ(world.camera.fx_px, drawn.camera.fx_px);
  EXPECT_EQ(world.camera.width_px, 320);
  EXPECT_EQ(world.camera.cx_px - 159.5, drawn.camera.cx_px - 305.5);
  EXPECT_EQ(world.axes.at(2).zero_offset, drawn.axes.at(2).zero_offset);
  EXPECT_EQ(world.rig.sample.links.at(1).direction, drawn.rig.sample.links.at(1).direction);
  EXPECT_TRUE(world.rig.lamp.home_pose.isApprox(drawn.rig.lamp.home_pose, 1e-12));
  EXPECT_EQ(world.mounts.at(devices::Target::mirror).tilt_about_x,
            drawn.mounts.at(devices::Target::mirror).tilt_about_x);
  EXPECT_NE(simulated_world(file, grey_plate(), 6).camera.fx_px, world.camera.fx_px);
  EXPECT_EQ(simulated_world(file, grey_plate(), 5).camera.fx_px, world.camera.fx_px);
  EXPECT_EQ(known.white.reflectance[1], 0.985);
  EXPECT_FALSE(known.white.angular.empty());
  expect_known(world, known);
}

TEST(SimulatedWorld, HiddenKeepsTheFilesSizes) {
  const RigFile file = hidden_file(
      "[rig]\ncamera_distance_mm = 300\nlamp_distance_mm = 450\n"
      "[camera]\nwidth_px = 2448\nheight_px = 2048\nfx_px = 5524\nfy_px = 5524\n"
      "cx_px = 1223.5\ncy_px = 1023.5\n[sample]\nhalf_width_mm = 20\n");
  const sim::SimOptions world = simulated_world(file, grey_plate(), 2);
  EXPECT_NEAR(world.rig.lamp.home_pose.translation().x(), 450.0, 2.0);
  EXPECT_NEAR(world.rig.camera.home_pose.translation().x(), 300.0, 0.5);
  EXPECT_NE(world.rig.camera.home_pose.translation().x(), 300.0);
  EXPECT_EQ(world.camera.width_px, 2448);
  EXPECT_NEAR(world.camera.fx_px, 5524.0, 0.005 * 5524.0);
  EXPECT_NEAR(world.camera.cx_px, 1223.5, 8.0);
  EXPECT_NE(world.camera.cx_px, 1223.5);
  EXPECT_EQ(world.scene.sample_half_width_mm, 22.0);
}

TEST(SimulatedWorld, HiddenIsForTheReferenceRig) {
  for (const char* other :
       {"[rig]\ntype = \"chains\"\naxes = [\"lamp_arm\", \"azimuth\", \"tilt\"]\n",
        "[camera]\npixel_format = \"bayer_rggb\"\n"}) {
    const std::string light =
        std::string(other).starts_with("[camera]") ? "white_light = true\n" : "";
    EXPECT_THAT(
        [&] {
          rig_file_from_text(std::string(other) + "[simulation]\nhidden = true\n" + light,
                             "rig.toml");
        },
        testing::ThrowsMessage<ConfigError>(HasSubstr("simulation.hidden")));
  }
}

}  // namespace
}  // namespace gonio::cli
