#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <optional>

#include "command.h"
#include "gonio/console/printable.h"
#include "gonio/design/published_sets.h"
#include "gonio/instrument/calibration_file.h"
#include "gonio/opened_rig/opened_rig.h"
#include "gonio/rig/reach.h"
#include "json_text.h"
#include "patch_geometry.h"
#include "session_calibration.h"

namespace gonio::cli {
namespace {

struct CheckOptions {
  std::string rig;
  bool connect = false;
  bool json = false;
};

struct ExampleOptions {
  std::string type = "la2";
};

std::string reach_text(const rig::ReachStatistics& reach, bool closed_form) {
  const auto percent = [&](std::size_t cells) {
    return 100.0 * static_cast<double>(cells) / static_cast<double>(reach.valid_cells);
  };
  std::string text =
      fmt::format("reach{}        {:.1f} % of {} directions\n",
                  closed_form ? "   " : " <=", percent(reach.reachable_cells), reach.valid_cells);
  for (const auto& [reason, cells] : reach.refused) {
    text += fmt::format("  refused       {:5.1f} %  {}\n", percent(cells), rig::to_string(reason));
  }
  return text;
}

/// Which calibration sessions on this rig file use, and until when.
std::string used_text(const instrument::Instrument& known,
                      const std::optional<SessionCalibration>& calibration) {
  return calibration ? calibration->text() : calibration_text({{"calibration", known.id}});
}

int check(Context& context, const CheckOptions& options) {
  const RigFile file = read_rig_file(options.rig);
  const instrument::Instrument known = instrument_of(file);
  const rig::Inverse inverse(known.rig, file.branches);
  const rig::ReachStatistics reach = [&] {
    const PhaseTimer timer(context.console, "reach");
    return rig::reach_statistics(inverse);
  }();
  const design::PublishedSet& published = design::published_set("nielsen-10");
  int published_reached = 0;
  for (const brdf::HalfDiff& direction : published.directions) {
    if (!inverse.solve(direction).poses.empty()) ++published_reached;
  }
  if (file.driver == RigFile::Driver::hardware) check_hardware_options(file);
  // Nothing moves: opening a device asks who it is and closes the shutter.
  std::vector<DeviceIdentity> devices = named_devices(file);
  std::optional<SessionCalibration> calibration = session_calibration(file, "");
  if (options.connect) {
    const auto opened = open_rig(file, Parts::all, context.stop);
    devices = opened->identities();
    if (calibration) calibration->use.serials = serials_of(*opened);
  }
  const bool in_plane_only = rig::reach_rank(known.rig) < 3;
  if (options.json) {
    nlohmann::ordered_json refused = nlohmann::ordered_json::object();
    for (const auto& [reason, cells] : reach.refused) {
      refused[std::string(rig::to_string(reason))] = cells;
    }
    const std::vector<std::string> reasons =
        calibration ? calibration->reasons() : std::vector<std::string>{};
    nlohmann::ordered_json identities = nlohmann::ordered_json::object();
    for (const DeviceIdentity& each : devices) identities[each.device] = each.identity;
    const nlohmann::ordered_json result = {{"rig", known.rig.name},
                                           {"driver", to_string(file.driver)},
                                           {"calibration", known.id},
                                           {"axes", known.rig.axes.size()},
                                           {"closed_form", inverse.closed_form()},
                                           {"in_plane_only", in_plane_only},
                                           {"valid_cells", reach.valid_cells},
                                           {"reachable_cells", reach.reachable_cells},
                                           {"refused_cells", refused},
                                           {"published_ten_reached", published_reached},
                                           {"connected", options.connect},
                                           {"devices", identities},
                                           {"calibration_text", used_text(known, calibration)},
                                           {"calibration_reasons", reasons}};
    context.console.result(json_text(result));
    return kSuccess;
  }
  std::string text = fmt::format("rig             {} ({})\n", known.rig.name,
                                 inverse.closed_form() ? "closed form" : "numeric inverse");
  text += fmt::format("constants       {}\n", printable_line(known.id));
  text += fmt::format("calibration     {}\n", printable_line(used_text(known, calibration)));
  if (calibration) {
    for (const std::string& reason : calibration->reasons()) {
      text += fmt::format("  against it    {}\n", printable_line(reason));
    }
  }
  for (const rig::Axis& axis : known.rig.axes) {
    text += fmt::format("axis            {:<12} {:g} to {:g} deg, home {:g}, {:g} deg/s\n",
                        axis.name, axis.min.degrees(), axis.max.degrees(), axis.home.degrees(),
                        axis.max_speed_deg_per_s);
  }
  text += fmt::format("camera          {} x {} px, {:.0f} mm away\n", known.camera.width_px,
                      known.camera.height_px, camera_distance_mm(known.rig));
  text += fmt::format("lamp            {}, {:.0f} mm away\n",
                      file.white_light ? "white" : "R, G, B in turn", lamp_distance_mm(known.rig));
  text += reach_text(reach, inverse.closed_form());
  if (in_plane_only) text += "  the axes reach in-plane directions only\n";
  text += fmt::format("published ten   {} of {} reached\n", published_reached,
                      published.directions.size());
  for (const DeviceIdentity& each : devices) {
    text += fmt::format("{:<15} {:<12} {}\n", options.connect ? "answers" : "named", each.device,
                        printable_line(each.identity));
  }
  context.console.result(text);
  if (!devices.empty() && !options.connect) {
    context.console.say("--connect asks the devices who they are; nothing moves");
  }
  return kSuccess;
}

int example(Context& context, const ExampleOptions& options) {
  RigFile file = default_rig_file();
  if (options.type == "calibration") {
    context.console.result(instrument::to_json(nominal_instrument(file)));
    return kSuccess;
  }
  if (options.type == "chains") file.kind = RigFile::Kind::chains;
  context.console.result(example_rig_text(file));
  return kSuccess;
}

}  // namespace

void add_rig(const Command& root) {
  const Command rig = root.add("rig", "Check a rig file, or print an example",
                               "gonio rig check rigs/simulated.toml");
  rig.require_subcommand();
  auto check_options = std::make_shared<CheckOptions>();
  const Command check_command =
      rig.add("check", "Validate a rig file; say its reach", "gonio rig check rigs/simulated.toml");
  check_command.text("RIG", check_options->rig, "Rig file", Need::required);
  check_command.flag("--connect", check_options->connect,
                     "Open every device as well and say who answers; nothing moves");
  check_command.flag("--json", check_options->json, "Print JSON");
  check_command.on_call(check_options, check);
  const Command example_command =
      rig.add("example", "Print a commented rig file", "gonio rig example > rig.toml");
  auto example_options = std::make_shared<ExampleOptions>();
  example_command.choice(
      "--type", example_options->type, {"la2", "chains", "calibration"},
      "The short form, the same rig as serial chains, or its nominal constants (JSON)");
  example_command.on_call(example_options, example);
}

}  // namespace gonio::cli
