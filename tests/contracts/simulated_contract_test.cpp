// The simulated devices under the contracts of their interfaces.

#include <numeric>

#include "camera_contract.h"
#include "gonio/brdf/diffuse_models.h"
#include "gonio/sim/sim_goniometer.h"
#include "light_contract.h"
#include "rotation_stage_contract.h"
#include "target_changer_contract.h"

namespace gonio::contracts {
namespace {

using namespace gonio::literals;
using namespace std::chrono_literals;

using World = std::shared_ptr<sim::SimGoniometer>;

sim::SimOptions options(devices::PixelFormat format = devices::PixelFormat::mono) {
  auto plate = std::make_shared<brdf::Lambertian>(brdf::Rgb::Constant(0.8));
  sim::SimOptions options = sim::nominal_options(std::move(plate), 1);
  options.scene.sample_half_width_mm = 100.0;  // fills the frame
  options.camera.pixel_format = format;
  if (format != devices::PixelFormat::mono) {
    options.lamp.channels = sim::LampOptions::white_channel();
  }
  return options;
}

World world(const sim::SimOptions& of = options()) {
  return std::make_shared<sim::SimGoniometer>(of);
}

/// With the plate turned to the lamp.
World ready_world(const sim::SimOptions& of = options()) {
  World made = world(of);
  for (std::size_t axis = 0; axis < made->axis_count(); ++axis) made->stage(axis).home(10min);
  made->stage(0).begin_move_to(45.0_deg);
  made->stage(1).begin_move_to(45.0_deg);
  for (std::size_t axis = 0; axis < made->axis_count(); ++axis) {
    made->stage(axis).wait_until_settled(10min);
  }
  return made;
}

template <typename Device>
std::shared_ptr<Device> part_of(const World& world, Device& device) {
  return {world, &device};
}

StageMaker stage(std::size_t axis, bool imperfect) {
  const std::string name = options().rig.axes[axis].name;
  return {
      name + (imperfect ? "_imperfect" : ""), [axis, imperfect] {
        sim::SimOptions of = options();
        of.axes.resize(of.rig.axes.size());
        if (imperfect) {
          of.axes[axis].backlash = 0.08_deg;
          of.axes[axis].zero_offset = 0.5_deg;
          of.axes[axis].eccentricity_cos = 0.02_deg;
        }
        const World made = world(of);
        // An encoder step and five sigmas of positioning.
        return StageUnderTest{part_of(made, made->stage(axis)), of.rig.axes[axis].home, 0.006_deg};
      }};
}

CameraMaker camera(devices::PixelFormat format) {
  return {std::string(to_string(format)), [format] {
            const World made = ready_world(options(format));
            return CameraUnderTest{part_of(made, made->camera()), part_of(made, made->clock()),
                                   [light = part_of(made, made->light_source())](bool on) {
                                     if (on) {
                                       light->light(light->channels().front().name);
                                     } else {
                                       light->close_shutter();
                                     }
                                   },
                                   20ms, 1.0};
          }};
}

LightMaker light(const std::string& name, devices::PixelFormat format) {
  return {name, [format] {
            const World made = ready_world(options(format));
            return LightUnderTest{
                part_of(made, made->light_source()), part_of(made, made->lamp_monitor()),
                [camera = part_of(made, made->camera())] {
                  const devices::Frame frame = camera->capture(20ms);
                  return std::accumulate(frame.pixels_dn.begin(), frame.pixels_dn.end(), 0.0) /
                             static_cast<double>(frame.pixels_dn.size()) -
                         frame.black_level_dn;
                }};
          }};
}

template <typename Maker>
std::string name_of(const testing::TestParamInfo<Maker>& info) {
  return info.param.name;
}

INSTANTIATE_TEST_SUITE_P(Simulated, RotationStageContract,
                         testing::Values(stage(0, false), stage(1, false), stage(2, false),
                                         stage(1, true)),
                         name_of<StageMaker>);

INSTANTIATE_TEST_SUITE_P(Simulated, CameraContract,
                         testing::Values(camera(devices::PixelFormat::mono),
                                         camera(devices::PixelFormat::bayer_rggb)),
                         name_of<CameraMaker>);

const auto kLights = testing::Values(light("three_colours", devices::PixelFormat::mono),
                                     light("white", devices::PixelFormat::bayer_rggb));
INSTANTIATE_TEST_SUITE_P(Simulated, LightSourceContract, kLights, name_of<LightMaker>);
INSTANTIATE_TEST_SUITE_P(Simulated, LampMonitorContract, kLights, name_of<LightMaker>);

INSTANTIATE_TEST_SUITE_P(Simulated, TargetChangerContract,
                         testing::Values(ChangerMaker{"motorised",
                                                      [] {
                                                        const World made = world();
                                                        return part_of(made,
                                                                       made->target_changer());
                                                      }}),
                         name_of<ChangerMaker>);

}  // namespace
}  // namespace gonio::contracts
