#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numeric>
#include <thread>
#include <utility>

#include "gonio/brdf/analytic_models.h"
#include "gonio/parallel/parallel.h"
#include "gonio/sim/joint.h"
#include "worlds.h"

namespace gonio::sim {
namespace {

using devices::DeviceErrc;
using devices::DeviceError;

std::shared_ptr<const brdf::BrdfModel> grey() {
  return std::make_shared<brdf::Lambertian>(brdf::Rgb::Constant(0.3));
}

/// All frames of a small session with everything switched on.
std::vector<std::vector<std::uint16_t>> session(std::uint64_t seed) {
  SimOptions options = nominal_options(grey(), seed);
  options.camera.psf_sigma_px = 0.7;
  SimGoniometer world(options);
  home(world);
  std::vector<std::vector<std::uint16_t>> frames;
  for (const std::vector<Angle>& pose :
       {std::vector<Angle>{60.0_deg, 30.0_deg, 5.0_deg}, {90.0_deg, 40.0_deg, 20.0_deg}}) {
    move_to(world, pose);
    for (const char* channel : {"R", "B"}) {
      world.light_source().light(channel);
      for (const auto exposure : {2ms, 20ms}) {
        frames.push_back(world.camera().capture(exposure).pixels_dn);
      }
    }
    world.light_source().close_shutter();
    frames.push_back(world.camera().capture(20ms).pixels_dn);
  }
  return frames;
}

TEST(SimGoniometer, SameSeedGivesTheSameBytesOnOneThreadAndOnMany) {
  parallel::set_thread_count(1);
  const auto one = session(7);
  parallel::set_thread_count(2);
  const auto two = session(7);
  parallel::set_thread_count(5);
  const auto five = session(7);
  parallel::set_thread_count(0);
  EXPECT_EQ(one, two);
  EXPECT_EQ(one, five);
}

TEST(SimGoniometer, AnotherSeedGivesAnotherWorld) { EXPECT_NE(session(7), session(8)); }

TEST(SimGoniometer, FramesOfOneSceneDifferInTheirNoise) {
  SimGoniometer world = SimGoniometer::nominal(grey(), 1);
  EXPECT_NE(world.camera().capture(1ms).pixels_dn, world.camera().capture(1ms).pixels_dn);
}

/// The frame that comes after all this, its time set aside.
std::vector<std::uint16_t> frame_of(SimGoniometer& world, std::uint64_t subject) {
  world.begin_subject(subject);
  return world.camera().capture(1ms).pixels_dn;
}

TEST(SimGoniometer, ASubjectHasTheSameNoiseWhateverCameBeforeIt) {
  SimGoniometer one = SimGoniometer::nominal(grey(), 1);
  SimGoniometer other = SimGoniometer::nominal(grey(), 1);
  frame_of(other, 3);
  other.camera().capture(1ms);
  EXPECT_EQ(frame_of(one, 5), frame_of(other, 5));
}

TEST(SimGoniometer, ASubjectHasNoiseOfItsOwnEachTimeItIsBegun) {
  SimGoniometer world = SimGoniometer::nominal(grey(), 1);
  const auto none = world.camera().capture(1ms).pixels_dn;
  const auto first = frame_of(world, 0);
  EXPECT_NE(first, none);
  EXPECT_NE(frame_of(world, 1), first);
  EXPECT_NE(frame_of(world, 0), first);

  SimOptions options = nominal_options(grey(), 1);
  options.same_noise_again = true;
  SimGoniometer same(options);
  EXPECT_EQ(frame_of(same, 0), first);
  EXPECT_EQ(frame_of(same, 0), first);
}

TEST(SimGoniometer, AnAxisStandsWhereItWasSentToTheLastBitWhereverItCameFrom) {
  SimOptions options = nominal_options(grey(), 1);
  AxisOptions exact;
  exact.homing_sigma = Angle();
  exact.positioning_sigma = Angle();
  exact.encoder_step = Angle();
  options.axes.assign(options.rig.axes.size(), exact);
  const auto stands = [&](std::initializer_list<double> by_way_of_deg) {
    SimGoniometer world(options);
    home(world);
    for (const double way : by_way_of_deg) {
      move_to(world, {60.0_deg, Angle::from_degrees(way), 5.0_deg});
    }
    return world.stage(kAzimuth).wait_until_settled(kPatience).radians();
  };
  EXPECT_EQ(stands({12.3}), stands({77.7, -3.1, 12.3}));
}

TEST(SimGoniometer, BeginsAtTheTimeItIsToldAndStandsElsewhereAfterAPowerUp) {
  SimOptions options = nominal_options(grey(), 1);
  options.begins_at = 90min;
  SimGoniometer world(options);
  EXPECT_EQ(world.clock().now(), 90min);

  const rig::Axis& axis = options.rig.axes[kAzimuth];
  Joint first(axis, AxisOptions(), 1, kAzimuth, 0);
  Joint second(axis, AxisOptions(), 1, kAzimuth, 1);
  EXPECT_NE(first.true_angle(0ns), second.true_angle(0ns));
  const auto homed = [](Joint& joint) {
    const auto end = joint.start_homing(0ns);
    joint.finish_homing();
    return joint.true_angle(end);
  };
  EXPECT_NE(homed(first), homed(second)) << "the mark is missed by something else";
}

TEST(SimGoniometer, OnlyWaitingLetsTimePass) {
  SimGoniometer world = SimGoniometer::nominal(grey(), 1);
  const auto took = [&](auto&& action) {
    const auto start = world.clock().now();
    action();
    return world.clock().now() - start;
  };
  auto& stage = world.stage(kAzimuth);
  EXPECT_EQ(took([&] { world.light_source().light("R"); }), 0ns);
  EXPECT_EQ(took([&] { world.lamp_monitor().read(); }), 0ns);
  EXPECT_EQ(took([&] { world.light_source().close_shutter(); }), 0ns);
  EXPECT_EQ(took([&] { EXPECT_THROW(world.camera().capture(1h), DeviceError); }), 0ns);
  EXPECT_EQ(took([&] { world.camera().capture(7ms); }), 7ms + 10ms);  // readout
  EXPECT_GT(took([&] { stage.home(kPatience); }), 2s);
  EXPECT_EQ(took([&] { stage.begin_move_to(10.0_deg); }), 0ns);
  EXPECT_EQ(took([&] { stage.stop(); }), 0ns);
  EXPECT_EQ(took([&] { stage.rearm(); }), 0ns);
  EXPECT_EQ(took([&] { world.target_changer().mount(devices::Target::white); }), 20s);
  EXPECT_EQ(took([&] { world.target_changer().mount(devices::Target::white); }), 0ns);
  EXPECT_EQ(took([&] { world.clock().wait_until(world.clock().now() + 3s); }), 3s);
}

TEST(SimGoniometer, ChangerRefusesUnderLightAndWhileAnAxisMoves) {
  SimGoniometer world = SimGoniometer::nominal(grey(), 1);
  auto& changer = world.target_changer();
  world.light_source().light("R");
  EXPECT_THROW(changer.mount(devices::Target::white), DeviceError);
  world.light_source().close_shutter();
  world.stage(kTilt).home(kPatience);
  world.stage(kTilt).begin_move_to(10.0_deg);
  EXPECT_THROW(changer.mount(devices::Target::white), DeviceError);
  EXPECT_EQ(changer.mounted(), devices::Target::sample);
  world.stage(kTilt).wait_until_settled(kPatience);
  changer.mount(devices::Target::white);
  EXPECT_EQ(changer.mounted(), devices::Target::white);
}

TEST(SimGoniometer, NominalWorldIsTheDescribedRigButForTheNormal) {
  const SimGoniometer world = SimGoniometer::nominal(grey(), 3);
  const SimOptions& truth = world.truth();
  EXPECT_EQ(truth.rig.axes.size(), 3U);
  for (const AxisOptions& axis : truth.axes) {
    EXPECT_EQ(axis.zero_offset, Angle());
    EXPECT_EQ(axis.backlash, Angle());
  }
  EXPECT_EQ(truth.white_mount.tilt_about_x, Angle());
  EXPECT_NE(truth.sample_mount.tilt_about_x, Angle());
  EXPECT_NE(truth.sample_mount.tilt_about_x, truth.sample_mount.tilt_about_y);
}

TEST(SimGoniometer, NominalTiltsScatterByATwentiethOfADegree) {
  double squares = 0.0;
  constexpr int kSeeds = 500;
  for (std::uint64_t seed = 0; seed < kSeeds; ++seed) {
    const MountOptions mount = nominal_options(grey(), seed).sample_mount;
    squares +=
        std::pow(mount.tilt_about_x.degrees(), 2.0) + std::pow(mount.tilt_about_y.degrees(), 2.0);
  }
  EXPECT_NEAR(std::sqrt(squares / (2 * kSeeds)), 0.05, 0.0045);  // four standard errors
}

TEST(SimGoniometer, NominalWhiteTileComesToHalfSaturationInTwentyMilliseconds) {
  SimGoniometer world = SimGoniometer::nominal(grey(), 1);
  home(world);
  move_to(world, {50.0_deg, 45.0_deg, 0.0_deg});
  world.target_changer().mount(devices::Target::white);
  for (const char* channel : {"R", "G", "B"}) {
    world.light_source().light(channel);
    const auto frame = world.camera().capture(20ms);
    const double dn = frame.at(kCentreRow, kCentreColumn);
    EXPECT_NEAR(dn, 0.5 * 4095.0, 150.0) << channel;
  }
}

TEST(SimGoniometer, NominalFrameHoldsSampleAndPatchApart) {
  SimGoniometer world = SimGoniometer::nominal(grey(), 1);
  const auto frame = picture(world, {60.0_deg, 0.0_deg, 0.0_deg}, 20ms);
  // 25 mm = 98.6 px, 34 mm = 134.2 px, holder between them at 31 mm = 122 px.
  const auto dn = [&](int column) { return frame.at(kCentreRow, column) - 64.0; };
  EXPECT_GT(dn(160 + 96), 150.0);
  EXPECT_GT(dn(160 - 96), 150.0);
  EXPECT_LT(dn(160 + 115), 60.0);
  EXPECT_GT(dn(160 + 134), 500.0);
}

TEST(SimGoniometer, AxisStartedDuringAnExposureShowsInItsPicture) {
  SimOptions options = nominal_options(grey(), 1);
  options.scene.sample_half_width_mm = 100.0;  // fills the frame
  for (LampChannelOptions& channel : options.lamp.channels) channel.intensity_w_per_sr *= 0.003;
  options.time_scale = 50.0;
  options.runs_by_itself = true;
  SimGoniometer world(options);
  const auto now = [&] { return world.clock().now(); };
  const auto go_to = [&](std::size_t axis, Angle target) {
    return world.joint(axis).move_to(target, now());
  };
  for (const auto settled : {go_to(kLampArm, 50.0_deg), go_to(kAzimuth, 45.0_deg)}) {
    world.clock().wait_until(settled);
  }
  world.light_source().light("G");
  const auto mean_dn = [&] {
    const auto frame = world.camera().capture(8s);
    return std::accumulate(frame.pixels_dn.begin(), frame.pixels_dn.end(), 0.0) /
               static_cast<double>(frame.pixels_dn.size()) -
           frame.black_level_dn;
  };
  const double still = mean_dn();
  EXPECT_NEAR(mean_dn() / still, 1.0, 0.01);
  const auto begin = now();
  std::thread mover([&] {
    world.clock().wait_until(begin + 1s);
    world.joint(kLampArm).move_to(100.0_deg, now());
  });
  const double moved = mean_dn();
  mover.join();
  EXPECT_GT(std::abs(moved / still - 1.0), 0.1);
}

TEST(SimGoniometer, IsMovable) {
  SimGoniometer world = SimGoniometer::nominal(grey(), 1);
  auto& camera = world.camera();
  const SimGoniometer moved = std::move(world);
  EXPECT_EQ(camera.capture(1ms).frame_id, 0U);
  EXPECT_GT(moved.true_joints().size(), 0U);
}

TEST(SimGoniometer, HasNoAxisBeyondTheLast) {
  SimGoniometer world = SimGoniometer::nominal(grey(), 1);
  EXPECT_EQ(world.axis_count(), 3U);
  EXPECT_THROW(world.stage(3), std::out_of_range);
}

}  // namespace
}  // namespace gonio::sim
