#pragma once

#include <memory>

#include "gonio/devices/camera.h"
#include "gonio/devices/clock.h"
#include "gonio/devices/light_source.h"
#include "gonio/devices/rotation_stage.h"
#include "gonio/devices/target_changer.h"
#include "gonio/sim/sim_options.h"

namespace gonio::sim {

class Joint;

/// One simulated rig: a hidden world, and the devices that see it.
///
/// World    Axes that move as motors do, a lamp that drifts, a flat target of any BRDF seen by a
///          camera at a finite distance, every pixel with its own directions. Image formation
///          shares with the rest of the project only forward kinematics and BRDF evaluation, so
///          that a wrong reduction cannot agree with a wrong simulation.
/// Time     Virtual (VirtualClock). Waiting for an axis, homing, exposing, changing the target and
///          Clock::wait_until() let it pass; nothing else does, unless the options say that it runs
///          by itself. Timeouts count virtual time.
/// Noise    Every random value is a function of the seed and of what it belongs to (subject, pixel,
///          frame, axis and move, second of drift): the same calls give the same bytes on any
///          number of threads.
/// State    As after power-up: axes somewhere within their limits and not homed, shutter closed,
///          the sample mounted.
/// Threads  As each interface says; devices of one world may be controlled from different threads
///          only as far as stop(), close_shutter() and Clock::now().
/// Lifetime The devices belong to the world and die with it. Movable; references to devices stay
///          valid.
class SimGoniometer {
 public:
  /// Throws std::invalid_argument as SimOptions::validate() does.
  explicit SimGoniometer(const SimOptions& options);
  ~SimGoniometer();
  SimGoniometer(SimGoniometer&&) noexcept;
  SimGoniometer& operator=(SimGoniometer&&) noexcept;

  /// The world of nominal_options().
  static SimGoniometer nominal(std::shared_ptr<const brdf::BrdfModel> material, std::uint64_t seed);

  /// The frames, monitor readings and moves that follow are for a subject: a point of a session,
  /// its white, its darks. Their noise is counted anew from here: a subject's first time in a world
  /// has the same noise whatever came before it, its second another, and so on
  /// (SimOptions::same_noise_again). So the world that a session is resumed in agrees with the one
  /// that died. `subject` below 2^31.
  void begin_subject(std::uint64_t subject);

  devices::Clock& clock();
  std::size_t axis_count() const;
  /// In the order of the rig's axes. Throws std::out_of_range.
  devices::RotationStage& stage(std::size_t axis);
  /// The mechanics alone, for an emulated drive that has a state machine of its own: use this or
  /// stage() of an axis, not both. Throws std::out_of_range.
  Joint& joint(std::size_t axis);
  devices::Camera& camera();
  devices::LightSource& light_source();
  devices::LampMonitor& lamp_monitor();
  devices::TargetChanger& target_changer();

  /// What is true now. For setting up, for tests and for reports of simulated sessions; what
  /// measures has no business here.
  const SimOptions& truth() const;
  rig::Joints true_joints() const;

 private:
  class World;
  std::unique_ptr<World> world_;
};

}  // namespace gonio::sim
