// gonio-emulate: virtual hardware for a rig file, on the wire.

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdlib>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "child_command.h"
#include "emulated_rig.h"
#include "fault_rules.h"
#include "folder_guard.h"
#include "gonio/brdf/diffuse_models.h"
#include "gonio/console/console.h"
#include "gonio/console/failures.h"
#include "gonio/console/standard_descriptors.h"
#include "gonio/console/stop_signals.h"
#include "gonio/console/suggest.h"
#include "gonio/files/atomic_file.h"
#include "gonio/files/text_file.h"
#include "gonio/private_network/private_network.h"
#include "gonio/setup/named_material.h"
#include "gonio/setup/simulated_rig.h"
#include "gonio/version/version.h"

namespace gonio::emulate {
namespace {

constexpr double kPlateAlbedo = 0.5;

struct Options {
  std::string rig;
  std::string material;
  std::vector<std::string> faults;
  double time_scale = 1.0;
  std::uint64_t seed = 1;
  std::optional<std::uint64_t> noise_seed;
  std::string account;
  std::vector<std::string> command;
};

std::shared_ptr<const brdf::BrdfModel> material_of(const Options& options,
                                                   const cli::RigFile& rig) {
  const std::string name = options.material.empty() ? rig.material : options.material;
  if (!name.empty()) return cli::load_sample(cli::named_material(name)).model;
  return std::make_shared<brdf::Lambertian>(brdf::Rgb::Constant(kPlateAlbedo));
}

/// CLI::Range lets "nan" through: it lies beyond neither end.
const CLI::Validator finite(
    [](std::string& text) {
      return std::isfinite(std::strtod(text.c_str(), nullptr)) ? std::string()
                                                               : "expected a finite number";
    },
    "");

std::string account_text(const TimeAccount& account) {
  return fmt::format(
      "{:.2f} s on the wire: axes {:.2f} s, exposures {:.2f} s, paced bytes {:.2f} s, together "
      "{:.2f} s; {:.1f} % overhead",
      account.wall_s, account.axes_s, account.exposures_s, account.wire_s, account.together_s,
      100.0 * account.overhead());
}

void write_account(const std::string& path, const TimeAccount& account) {
  const nlohmann::ordered_json json = {
      {"wall_s", account.wall_s},           {"axes_s", account.axes_s},
      {"exposures_s", account.exposures_s}, {"wire_s", account.wire_s},
      {"together_s", account.together_s},   {"overhead", account.overhead()}};
  files::write_text_file(path, json.dump(2) + "\n", files::Overwrite::Yes);
}

void wait_until_stopped(const std::stop_token& stop) {
  constexpr std::chrono::milliseconds kStopPoll{50};
  while (!stop.stop_requested()) std::this_thread::sleep_for(kStopPoll);
}

/// A loopback of the program's own, with all addresses of the rig's network devices.
void enter_private_network(const cli::RigFile& rig) {
  std::vector<std::string> addresses;
  for (const cli::BusEntry& bus : rig.devices.buses) {
    if (bus.kind == cli::BusEntry::Kind::modbus_tcp) addresses.push_back(bus.host);
  }
  addresses.push_back(rig.devices.camera.id);
  const std::string refused = private_network::enter(addresses);
  if (!refused.empty()) {
    throw std::runtime_error("no network of its own for the emulated rig: " + refused);
  }
}

int emulate(const cli::Console& console, const Options& options) {
  const cli::RigFile rig = cli::read_rig_file(options.rig);
  if (rig.driver != cli::RigFile::Driver::hardware) {
    throw cli::UsageError(options.rig + ": rig.driver: found simulated, expected hardware",
                          "a simulated rig needs no emulation: gonio runs it by itself");
  }
  sim::SimOptions world = cli::simulated_world(rig, material_of(options, rig), options.seed);
  world.time_scale = options.time_scale;
  world.runs_by_itself = true;
  world.noise_seed = options.noise_seed;
  const std::vector<emulator_faults::FaultRule> rules = fault_rules(options.faults, rig);
  const FolderGuard guard;
  if (options.command.empty()) {
    const cli::StopSignals signals;
    const EmulatedRig emulated(rig, world, rules, options.seed);
    guard.watch(emulated.folder());
    for (const std::string& line : emulated.addresses()) console.say(line);
    for (const auto& [name, value] : emulated.environment()) {
      console.result(fmt::format("export {}='{}'\n", name, value));
    }
    console.say("emulating until Control-C; programs need the environment printed above");
    wait_until_stopped(signals.token());
    return cli::kSuccess;
  }
  // Before any thread: the command and the emulators get a loopback of their own, so that several
  // emulated rigs can live side by side.
  enter_private_network(rig);
  const EmulatedRig emulated(rig, world, rules, options.seed);
  guard.watch(emulated.folder());
  const HostTime started = std::chrono::steady_clock::now();
  ChildCommand child(options.command, emulated.environment());
  const int code = child.wait();
  const TimeAccount account = emulated.account({started, child.ended_at()});
  console.detail(account_text(account));
  if (!options.account.empty()) write_account(options.account, account);
  return code;
}

int run(int argc, char** argv) {
  cli::Console console;
  Options options;
  bool quiet = false;
  bool verbose = false;
  CLI::App app{"Puts virtual hardware for a rig file on the wire: Modbus, USB, GigE Vision.",
               "gonio-emulate"};
  app.set_version_flag("--version", fmt::format("gonio-emulate {} ({})", version(), revision()));
  app.footer(
      "Example:\n  gonio-emulate rigs/wire.toml --material builtin:gold-satin -- \\\n"
      "    gonio measure rigs/wire.toml --plan plan.csv --out session\n"
      "  gonio-emulate rigs/wire.toml --fault late_reply@tilt:after_s=5,count=3 -- "
      "gonio home rigs/wire.toml");
  app.add_option("RIG", options.rig, "Rig file with driver = \"hardware\"")->required();
  app.add_option("--material", options.material,
                 "What lies on the rig: a material file or builtin:NAME (default: a grey plate)");
  app.add_option("--time-scale", options.time_scale,
                 "Seconds of the emulated world in one of the host's")
      ->check(CLI::Range(0.01, 1000.0))
      ->check(finite)
      ->capture_default_str();
  app.add_option("--fault", options.faults,
                 "NAME[@DEVICE][:after_s=,for_s=,skip=,count=,probability=]; may be repeated")
      ->expected(1)
      ->take_all();
  app.add_option("--seed", options.seed, "Of the emulated world and its faults")
      ->capture_default_str();
  app.add_option("--noise-seed", options.noise_seed,
                 "Of shot noise and readings alone: another session on the same rig");
  app.add_option("--account", options.account, "Where the time went, as JSON");
  app.add_flag("-v,--verbose", verbose, "Say more");
  app.add_flag("-q,--quiet", quiet, "Say nothing but errors");
  app.add_option("COMMAND", options.command,
                 "Behind --: run inside the emulated machine; its exit code is passed on");
  // What stands behind -- belongs to the command, whatever it looks like.
  char** const end = argv + argc;
  char** const dashes =
      std::find_if(argv, end, [](const char* word) { return std::string_view(word) == "--"; });
  try {
    app.parse(static_cast<int>(dashes - argv), argv);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return app.exit(error);
    console.error(error.what(), "gonio-emulate --help says more");
    return cli::kBadInput;
  }
  if (dashes != end) options.command.assign(dashes + 1, end);
  console.verbosity = quiet ? -1 : (verbose ? 1 : 0);
  try {
    return emulate(console, options);
  } catch (const std::exception& error) {
    const cli::Failure failure = cli::describe(error);
    console.error(failure.message, failure.hint);
    return failure.code;
  }
}

}  // namespace
}  // namespace gonio::emulate

int main(int argc, char** argv) {
  gonio::cli::hold_standard_descriptors();
  std::signal(SIGPIPE, SIG_IGN);
  return gonio::emulate::run(argc, argv);
}
