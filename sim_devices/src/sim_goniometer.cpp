#include "gonio/sim/sim_goniometer.h"

#include <cstdint>
#include <map>
#include <utility>
#include <vector>

#include "camera.h"
#include "changer.h"
#include "gonio/sim/joint.h"
#include "gonio/sim/virtual_clock.h"
#include "lamp_output.h"
#include "light.h"
#include "stage.h"
#include "subject.h"

namespace gonio::sim {
namespace {

/// Checked, and with one entry per axis.
SimOptions completed(SimOptions options) {
  options.validate();
  options.axes.resize(options.rig.axes.size());
  return options;
}

}  // namespace

/// Everything, in the order in which one part needs another.
class SimGoniometer::World {
 public:
  explicit World(const SimOptions& given)
      : options(completed(given)),
        clock(options.time_scale,
              options.runs_by_itself ? VirtualClock::Between::runs
                                     : VirtualClock::Between::stands_still,
              options.begins_at),
        lamp_output(options.lamp, options.seed),
        light(options.lamp),
        monitor(options.lamp, light, lamp_output, clock, options.noise_seed.value_or(options.seed)),
        changer(options.change_time, joints, light, clock),
        camera(options, CameraView{joints, light, lamp_output, changer, clock}) {
    for (std::size_t axis = 0; axis < options.rig.axes.size(); ++axis) {
      const rig::Axis& described = options.rig.axes[axis];
      joints.push_back(std::make_unique<Joint>(described, options.axes[axis], options.seed, axis,
                                               options.power_ups));
      stages.push_back(std::make_unique<SimRotationStage>(described, *joints.back(), clock,
                                                          options.axes[axis].tells_home_delta));
    }
  }

  SimOptions options;
  VirtualClock clock;
  std::vector<std::unique_ptr<Joint>> joints;
  std::vector<std::unique_ptr<SimRotationStage>> stages;
  LampOutput lamp_output;
  SimLightSource light;
  SimLampMonitor monitor;
  SimTargetChanger changer;
  SimCamera camera;
  std::map<std::uint64_t, std::uint64_t> begun;  ///< how often, by subject
};

SimGoniometer::SimGoniometer(const SimOptions& options)
    : world_(std::make_unique<World>(options)) {}
SimGoniometer::~SimGoniometer() = default;
SimGoniometer::SimGoniometer(SimGoniometer&&) noexcept = default;
SimGoniometer& SimGoniometer::operator=(SimGoniometer&&) noexcept = default;

SimGoniometer SimGoniometer::nominal(std::shared_ptr<const brdf::BrdfModel> material,
                                     std::uint64_t seed) {
  return SimGoniometer(nominal_options(std::move(material), seed));
}

void SimGoniometer::begin_subject(std::uint64_t subject) {
  const std::uint64_t before = world_->options.same_noise_again ? 0 : world_->begun[subject]++;
  const std::uint64_t index = first_index_of(subject, before);
  world_->camera.count_noise_from(index);
  world_->monitor.count_noise_from(index);
  for (const auto& joint : world_->joints) joint->count_noise_from(index);
}

devices::Clock& SimGoniometer::clock() { return world_->clock; }
std::size_t SimGoniometer::axis_count() const { return world_->stages.size(); }
devices::RotationStage& SimGoniometer::stage(std::size_t axis) { return *world_->stages.at(axis); }
Joint& SimGoniometer::joint(std::size_t axis) { return *world_->joints.at(axis); }
devices::Camera& SimGoniometer::camera() { return world_->camera; }
devices::LightSource& SimGoniometer::light_source() { return world_->light; }
devices::LampMonitor& SimGoniometer::lamp_monitor() { return world_->monitor; }
devices::TargetChanger& SimGoniometer::target_changer() { return world_->changer; }
const SimOptions& SimGoniometer::truth() const { return world_->options; }

rig::Joints SimGoniometer::true_joints() const {
  rig::Joints joints;
  for (const auto& joint : world_->joints) {
    joints.push_back(joint->true_angle(world_->clock.now()));
  }
  return joints;
}

}  // namespace gonio::sim
