#include <fmt/format.h>

#include <cmath>

#include "command.h"
#include "gonio/rig/travel.h"
#include "hands_on.h"

namespace gonio::cli {
namespace {

struct GotoOptions : HandsOnOptions {
  std::vector<std::string> targets;  ///< AXIS=DEG
  std::vector<double> direction_deg;
};

/// The pose of a direction that is reached soonest.
rig::Joints pose_of(const HandsOn& rig, const rig::Joints& from, const std::vector<double>& deg) {
  for (std::size_t i = 0; i < deg.size(); ++i) {
    constexpr double kLargest_deg[] = {90.0, 90.0, 360.0};
    constexpr const char* kName[] = {"theta_h", "theta_d", "phi_d"};
    const double smallest_deg = i == 2 ? -kLargest_deg[i] : 0.0;
    if (deg[i] >= smallest_deg && deg[i] <= kLargest_deg[i]) continue;
    throw UsageError(fmt::format("--direction: {}: found {:g}, expected {:g} to {:g} deg", kName[i],
                                 deg[i], smallest_deg, kLargest_deg[i]));
  }
  const brdf::HalfDiff direction{Angle::from_degrees(deg[0]), Angle::from_degrees(deg[1]),
                                 Angle::from_degrees(deg[2]), Angle()};
  const rig::Reach reach = rig::Inverse(rig.instrument().rig, rig.file().branches).solve(direction);
  if (reach.refusal) {
    throw UsageError(fmt::format("({:g}, {:g}, {:g}) deg: {}: {}", deg[0], deg[1], deg[2],
                                 rig::to_string(reach.refusal->reason), reach.refusal->detail));
  }
  const rig::TravelModel travel(rig.instrument().rig);
  const rig::PoseSolution* best = &reach.poses.front();
  for (const rig::PoseSolution& pose : reach.poses) {
    if (travel.seconds(from, pose.joints) < travel.seconds(from, best->joints)) best = &pose;
  }
  return best->joints;
}

void set_target(const HandsOn& rig, rig::Joints& joints, const std::string& word) {
  const std::size_t equals = word.find('=');
  std::size_t used = 0;
  double degrees = std::nan("");
  try {
    if (equals != std::string::npos) degrees = std::stod(word.substr(equals + 1), &used);
  } catch (const std::exception&) {
    used = 0;
  }
  if (!std::isfinite(degrees) || used != word.size() - equals - 1) {
    throw UsageError(fmt::format("found \"{}\", expected AXIS=DEGREES", word));
  }
  joints[rig.axis(word.substr(0, equals))] = Angle::from_degrees(degrees);
}

int go(Context& context, const GotoOptions& options) {
  if (options.targets.empty() == options.direction_deg.empty()) {
    throw UsageError("expected either AXIS=DEGREES or --direction");
  }
  if (!options.direction_deg.empty() && options.direction_deg.size() != 3) {
    throw UsageError(fmt::format("--direction: found {} numbers, expected theta_h,theta_d,phi_d",
                                 options.direction_deg.size()));
  }
  HandsOn rig(context, options, Parts::axes_and_lamp);
  // What can be refused is refused before anything is homed.
  rig::Joints checked = rig.instrument().rig.home();
  for (const std::string& word : options.targets) set_target(rig, checked, word);
  if (!options.direction_deg.empty()) checked = pose_of(rig, checked, options.direction_deg);
  rig.require_allowed(checked);
  rig.make_ready();
  rig::Joints target = rig.guarded().joints();
  for (const std::string& word : options.targets) set_target(rig, target, word);
  if (!options.direction_deg.empty()) target = pose_of(rig, target, options.direction_deg);
  rig.move_to(target);
  rig.print_joints();
  rig.finish();
  return kSuccess;
}

}  // namespace

void add_goto(const Command& root) {
  auto options = std::make_shared<GotoOptions>();
  const Command command = root.add("goto", "Move axes to angles, or to a BRDF direction",
                                   "gonio goto rigs/lab_example.toml lamp_arm=45 tilt=10\n"
                                   "  gonio goto rigs/lab_example.toml --direction 10,30,90");
  add_hands_on_options(command, *options, true);
  command.texts("TARGET", options->targets, "AXIS=DEGREES, as many as wanted");
  command.numbers("--direction", options->direction_deg, "theta_h,theta_d,phi_d in degrees");
  command.on_call(options, go);
}

}  // namespace gonio::cli
