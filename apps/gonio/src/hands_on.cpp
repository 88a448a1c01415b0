#include "hands_on.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "gonio/console/suggest.h"
#include "gonio/devices/homing_report.h"
#include "gonio/rig/paths.h"
#include "json_text.h"

namespace gonio::cli {
namespace {

/// Where an axis that will say so believes to stand; nothing of one that would not know after.
std::optional<Angle> believed_of(devices::RotationStage& stage) {
  constexpr std::chrono::milliseconds kPatience{10000};  // one taken over on its way
  const auto* const report = dynamic_cast<const devices::HomingReport*>(&stage);
  if (report == nullptr || !report->tells()) return std::nullopt;
  try {
    return stage.wait_until_settled(kPatience);
  } catch (const devices::DeviceError&) {
    return std::nullopt;  // not homed; what else it may be, homing says
  }
}

std::string text_of_homing(const std::string& name,
                           const std::optional<devices::StoodBeforeHome>& stood,
                           const std::optional<Angle>& believed) {
  if (!stood) return name + ": its count was read too seldom to tell where it stood before";
  std::string text = fmt::format("{}: stood at {:.4f} deg before", name, stood->angle.degrees());
  if (believed) {
    text +=
        fmt::format(", {:+.4f} deg from where it believed", (stood->angle - *believed).degrees());
  }
  if (stood->within > Angle()) text += fmt::format(" (within {:.4f} deg)", stood->within.degrees());
  return text;
}

}  // namespace

void add_hands_on_options(const Command& command, HandsOnOptions& options, bool may_home) {
  command.text("RIG", options.rig, "Rig file", Need::required);
  command.text("--calibration", options.calibration, "Instrument constants");
  if (may_home) command.flag("--home", options.home, "Home all axes first");
  command.flag("--json", options.json, "Print JSON");
}

HandsOn::HandsOn(Context& context, const HandsOnOptions& options, Parts parts)
    : context_(context),
      options_(options),
      known_(known_rig(options.rig, options.calibration)),
      opened_(open_rig(known_.file, parts, context.stop)) {
  const auto note = [&console = context.console](std::chrono::nanoseconds, const std::string& kind,
                                                 const std::string& text) {
    console.warn(kind + ": " + text);
  };
  guarded_.emplace(opened_->devices(), known_.constants.rig, known_.file.session, note,
                   context.stop);
}

void HandsOn::home() {
  const auto& stages = devices().stages;
  std::vector<std::optional<Angle>> believed;
  for (devices::RotationStage* stage : stages) believed.push_back(believed_of(*stage));
  context_.console.say("homing");
  guarded_->home_all();
  for (std::size_t i = 0; i < stages.size(); ++i) {
    const auto* const report = dynamic_cast<const devices::HomingReport*>(stages[i]);
    if (report == nullptr || !report->tells()) continue;
    context_.console.say(
        text_of_homing(stages[i]->name(), report->stood_before_home(), believed[i]));
  }
}

void HandsOn::make_ready() {
  if (options_.home) return home();
  try {
    guarded_->take_over();
  } catch (const devices::DeviceError& error) {
    if (error.code() != devices::DeviceErrc::NotHomed) throw;
    throw UsageError(
        error.what(),
        known_.file.driver == RigFile::Driver::hardware
            ? "--home homes all axes first; `gonio home` does it once for drives that can say "
              "that they are homed"
            : "a simulated rig is new with every command: --home homes it first");
  }
}

void HandsOn::require_allowed(const rig::Joints& target) const {
  const rig::RigDescription& rig = known_.constants.rig;
  for (std::size_t i = 0; i < target.size(); ++i) {
    const rig::Axis& axis = rig.axes[i];
    if (target[i] >= axis.min && target[i] <= axis.max) continue;
    throw UsageError(fmt::format("{}: found {:g} deg, expected {:g} to {:g} deg", axis.name,
                                 target[i].degrees(), axis.min.degrees(), axis.max.degrees()));
  }
  if (const auto box = rig::keep_out_at(rig, target, rig::kPlanningMargin)) {
    throw UsageError(fmt::format("that pose lies in the keep-out \"{}\"", *box));
  }
}

void HandsOn::move_to(const rig::Joints& target) {
  require_allowed(target);
  const rig::TravelModel travel(known_.constants.rig);
  if (const auto route = travel.route(guarded_->joints(), target)) {
    context_.console.detail(fmt::format("about {}", duration_text(route->seconds)));
  }
  guarded_->move_to(target);
}

void HandsOn::finish() {
  guarded_.reset();
  opened_->require_safe();
}

std::size_t HandsOn::axis(const std::string& name) const {
  std::vector<std::string> names;
  for (const rig::Axis& axis : known_.constants.rig.axes) {
    if (axis.name == name) return names.size();
    names.push_back(axis.name);
  }
  throw UsageError(
      fmt::format("{}: found no axis \"{}\"{}", options_.rig, name, did_you_mean(name, names)));
}

void HandsOn::print_joints() const {
  const rig::RigDescription& rig = known_.constants.rig;
  const rig::Joints& joints = guarded_->joints();
  if (options_.json) {
    nlohmann::ordered_json result;
    for (std::size_t i = 0; i < joints.size(); ++i) {
      result[rig.axes[i].name + "_deg"] = joints[i].degrees();
    }
    context_.console.result(json_text(result));
    return;
  }
  std::string text;
  for (std::size_t i = 0; i < joints.size(); ++i) {
    text += fmt::format("{:<16} {:10.4f} deg\n", rig.axes[i].name, joints[i].degrees());
  }
  context_.console.result(text);
}

}  // namespace gonio::cli
