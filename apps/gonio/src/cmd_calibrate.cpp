#include <fmt/chrono.h>
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "asking_changer.h"
#include "calibration_run.h"
#include "chart_certificate.h"
#include "command.h"
#include "gonio/calibration/result/step_refused.h"
#include "gonio/calibration/routine/routine.h"
#include "gonio/calibration_report/calibration_report.h"
#include "gonio/console/suggest.h"
#include "gonio/errors/errors.h"
#include "gonio/files/atomic_file.h"
#include "gonio/files/process_lock.h"
#include "gonio/opened_rig/opened_rig.h"
#include "gonio/setup/calibration_settings.h"
#include "gonio/setup/simulated_rig.h"
#include "json_text.h"
#include "outputs.h"

namespace gonio::cli {
namespace {

namespace routine = calibration::routine;

struct CalibrateOptions {
  std::string rig;
  std::string out;
  std::vector<std::string> only;
  std::optional<std::uint64_t> seed;
  bool redo = false;
  bool list = false;
  bool yes = false;
  bool json = false;
  double square_mm = 0.0;  ///< 0: as drawn
  std::string chart;
  double patch_mm = calibration::routine::ChartSpec{}.patch_mm;
  double gap_mm = calibration::routine::ChartSpec{}.gap_mm;
  double temperature_deg_c = std::numeric_limits<double>::quiet_NaN();  ///< not told
};

std::vector<std::string> step_names() {
  std::vector<std::string> names;
  for (const auto& step : instrument::calibration_steps()) names.emplace_back(step.name);
  return names;
}

std::string state_text(const routine::Routine& calibration, const std::string& step) {
  const auto state = calibration.state_of(step);
  const instrument::StepResult* result = instrument::find_result(calibration.archive(), step);
  if (state != instrument::StepState::valid || result == nullptr) {
    return std::string(instrument::to_string(state));
  }
  return fmt::format("valid until {:%F}", result->valid_until);
}

/// Where the steps stand: what a person sees at the end.
std::string table(const routine::Routine& calibration) {
  std::string text;
  for (const auto& step : instrument::calibration_steps()) {
    text += fmt::format("{:<16} {:<22} {}\n", step.name,
                        state_text(calibration, std::string(step.name)), step.finds);
  }
  return text;
}

nlohmann::ordered_json as_json(const routine::Routine& calibration) {
  nlohmann::ordered_json steps = nlohmann::ordered_json::array();
  for (const std::string& step : step_names()) {
    nlohmann::ordered_json each{{"step", step},
                                {"state", instrument::to_string(calibration.state_of(step))}};
    if (const auto* result = instrument::find_result(calibration.archive(), step)) {
      each["valid_until_utc_s"] = result->valid_until.time_since_epoch().count();
      for (const auto& parameter : result->parameters) {
        const auto i = &parameter - result->parameters.data();
        each["parameters"][parameter.name] = {{"value", parameter.value},
                                              {"unit", parameter.unit},
                                              {"sigma", std::sqrt(result->covariance(i, i))}};
      }
      for (const auto& check : result->checks) {
        each["checks"][check.name] = {{"found", check.found}, {"limit", check.limit}};
      }
    }
    steps.push_back(std::move(each));
  }
  return {{"complete", instrument::steps_to_take(calibration.archive(), now_utc()).empty()},
          {"steps", steps}};
}

void require_steps(const std::vector<std::string>& steps) {
  const std::vector<std::string> known = step_names();
  for (const std::string& step : steps) {
    if (std::find(known.begin(), known.end(), step) != known.end()) continue;
    throw UsageError(fmt::format("--only: no calibration step is called \"{}\"{}", step,
                                 did_you_mean(step, known)),
                     "--list names them all");
  }
}

/// With the targets that the operator has at hand.
routine::RoutineSettings settings_of(const RigFile& rig, const CalibrateOptions& options) {
  routine::RoutineSettings settings = calibration_settings(rig);
  const bool simulated = rig.driver == RigFile::Driver::simulated;
  if (simulated && (options.square_mm > 0.0 || !options.chart.empty())) {
    throw UsageError("--square-mm, --chart: a simulated rig has targets of its own");
  }
  if (!std::isnan(options.temperature_deg_c)) {
    settings.temperature_deg_c = options.temperature_deg_c;
  }
  if (options.square_mm > 0.0) {
    settings.board.square_mm = options.square_mm;
    settings.board_measured = true;
  }
  if (!options.chart.empty()) {
    settings.chart = read_chart(options.chart, options.patch_mm, options.gap_mm);
  }
  return settings;
}

files::ProcessLock locked(const std::filesystem::path& folder) {
  try {
    return files::ProcessLock(folder / "calibration.lock");
  } catch (const files::HeldByAnother& held) {
    throw UsageError(
        fmt::format("{}: process {} is calibrating in this folder", folder.string(), held.holder()),
        "wait for it, or begin in another folder");
  }
}

/// Before the first move: an hour's warm-up should not end at a folder that takes nothing.
void require_writable(const routine::Folder& folder) {
  const std::filesystem::path raw = folder.raw_folder();
  for (const auto& file : {folder.archive(), folder.instrument(), report_in(folder.path)}) {
    require_replaceable_file(file);
  }
  std::error_code error;
  std::filesystem::create_directories(raw, error);
  if (error) throw FileError(raw, "make", error.message());
  files::require_creatable(raw / "probe");
}

/// Throws UsageError when one of the steps named alone will lack what it needs.
void require_inputs(const instrument::CalibrationArchive& archive,
                    const std::vector<std::string>& steps) {
  try {
    instrument::require_takeable(archive, steps, now_utc());
  } catch (const std::invalid_argument& error) {
    throw UsageError(error.what());
  }
}

/// The same before a device is opened, by the folder's file alone.
void require_inputs(const routine::Folder& folder, const std::vector<std::string>& steps) {
  instrument::CalibrationArchive archive;
  if (std::filesystem::exists(folder.archive())) {
    archive = instrument::read_calibration_archive(folder.archive());
  }
  require_inputs(archive, steps);
}

/// What is to be done: what was named, or everything. None: what has to be.
std::vector<std::string> steps_wanted(const CalibrateOptions& options) {
  if (options.redo && options.only.empty()) return step_names();
  std::vector<std::string> wanted;
  for (const std::string& step : step_names()) {
    if (std::find(options.only.begin(), options.only.end(), step) != options.only.end()) {
      wanted.push_back(step);
    }
  }
  return wanted;
}

int calibrate(Context& context, const CalibrateOptions& options) {
  const Console& console = context.console;
  require_steps(options.only);
  const RigFile rig = read_rig_file(options.rig);
  const bool simulated = rig.driver == RigFile::Driver::simulated;
  if (options.yes && !simulated && rig.devices.changer.bus.empty()) {
    throw UsageError("--yes: nobody would mount the targets",
                     "leave it out and follow the prompts, or name a [changer] in the rig file");
  }
  if (options.seed && !simulated) throw UsageError("--seed: a rig of metal has no world to draw");
  if (rig.kind != RigFile::Kind::la2) {
    throw UsageError(options.rig + ": rig.type: found \"chains\", expected \"la2\"",
                     "the calibration routine knows the reference rig only");
  }
  const routine::RoutineSettings settings = settings_of(rig, options);
  if (options.out.empty()) throw UsageError("--out: the path names no folder");
  if (std::filesystem::exists(options.out) && !std::filesystem::is_directory(options.out)) {
    throw UsageError(fmt::format("--out: {} is no folder", options.out));
  }
  const std::vector<std::string> wanted = steps_wanted(options);
  std::optional<files::ProcessLock>
      alone;  // a program keeps the archive in memory and writes it whole
  if (!options.list) {
    require_writable({options.out});
    alone.emplace(locked(options.out));
    require_inputs(routine::Folder{options.out}, wanted);
  }
  const auto opened = open_rig(rig, Parts::all, context.stop, options.seed.value_or(1));
  routine::Routine calibration =
      calibration_in({options.out, options.list}, rig, settings, *opened);
  for (const std::string& notice : calibration.notices()) console.warn(notice);
  const auto finish = [&](int code) {
    if (options.json) {
      console.result(json_text(as_json(calibration)));
    } else {
      console.result(table(calibration));
    }
    return code;
  };
  if (options.list) return finish(kSuccess);

  require_inputs(calibration.archive(), wanted);
  // From here on: whatever ends this, what was asked for anew is not there until it was taken.
  if (options.redo) {
    calibration.redo(wanted);
    write_calibration_report(calibration, options.out, rig, {});
  }
  AskingChanger person(opened->devices().changer, context.stop);
  acquisition::DeviceSet devices = opened->devices();
  if (!options.yes) devices.changer = &person;
  const StepBench bench{context, calibration, devices, passes_at_once(rig)};
  const auto refused = wanted.empty() ? take_open_steps(bench) : take_steps(bench, wanted);
  if (refused) {
    console.error(refused->step + ": " + refused->why,
                  fmt::format("nothing of it was kept; mend it, then the same command goes on "
                              "with {}",
                              refused->step));
  }
  opened->require_safe();
  const std::filesystem::path folder = options.out;
  write_calibration_report(
      calibration, folder, rig,
      refused ? std::vector{*refused} : std::vector<calibration_report::RefusedStep>{});
  if (!refused && instrument::steps_to_take(calibration.archive(), now_utc()).empty()) {
    console.say(fmt::format("{}: calibrated; look at {}, then measure with --calibration {}",
                            options.out, report_in(folder).string(), options.out));
  }
  return finish(refused ? kDoNotTrust : kSuccess);
}

/// Says of an interruption what it leaves.
int calibrate_until_stopped(Context& context, const CalibrateOptions& options) {
  try {
    return calibrate(context, options);
  } catch (const Interrupted&) {
  } catch (const devices::DeviceError& error) {
    if (!context.stop.stop_requested() || error.code() != devices::DeviceErrc::Stopped) throw;
  }
  context.console.error(
      "interrupted",
      fmt::format(
          "what {} holds stays, but for what was to be taken again; without --redo the same "
          "command goes on",
          options.out));
  return kFailure;
}

}  // namespace

void add_calibrate(const Command& root) {
  auto options = std::make_shared<CalibrateOptions>();
  const Command command =
      root.add("calibrate", "Find a rig's constants step by step, with their uncertainty",
               "gonio calibrate rigs/uncalibrated.toml --out calibration --yes");
  command.text("RIG", options->rig, "Rig file", Need::required);
  command.text("--out", options->out,
               "Folder of the calibration; one that is there is gone on with", Need::required);
  command.texts("--only", options->only, "Take these steps alone, valid or not");
  command.flag("--redo", options->redo,
               "Take all steps again, or those of --only; the old results do not hold any more");
  command.flag("--list", options->list, "Say where the steps stand; take none");
  command.seed(options->seed, "Of the simulated world (default 1)");
  command.flag("--yes", options->yes, "A simulated rig or a motorised changer mounts the targets");
  command.number(
      "--square-mm", options->square_mm, 1.0, 100.0,
      "Edge of the printed board's squares as measured (default: what the folder's steps "
      "were told, else 10, as gonio board draws them)");
  command.text("--chart", options->chart,
               "Colour chart's values (CSV: row, column, red, green, blue; linear, white = 1)");
  command.number("--patch-mm", options->patch_mm, 1.0, 100.0, "Edge of the chart's patches");
  command.number("--gap-mm", options->gap_mm, 0.0, 50.0, "Between the chart's patches");
  command.number("--temperature", options->temperature_deg_c, -40.0, 80.0,
                 "Of the room, deg C: kept with what is taken; darks of another are taken again");
  command.flag("--json", options->json, "Print JSON");
  command.on_call(options, calibrate_until_stopped);
}

}  // namespace gonio::cli
