#include "calibration_run.h"

#include <fmt/format.h>

#include <chrono>
#include <functional>
#include <stdexcept>
#include <utility>

#include "gonio/calibration/result/step_refused.h"
#include "gonio/calibration/routine/expected_time.h"
#include "gonio/errors/errors.h"
#include "gonio/files/text_file.h"
#include "gonio/setup/simulated_rig.h"

namespace gonio::cli {

namespace routine = calibration::routine;

instrument::UtcSeconds now_utc() {
  return std::chrono::floor<std::chrono::seconds>(std::chrono::system_clock::now());
}

routine::Routine calibration_in(const routine::Folder& folder, const RigFile& rig,
                                routine::RoutineSettings settings, OpenedRig& opened) {
  return blame(folder.path.string(), [&] {
    return routine::Routine(nominal_instrument(rig), std::move(settings), folder,
                            serials_of(opened), now_utc);
  });
}

namespace {

using Steps = std::vector<std::string>;

/// How much of the time steps take, in units of which only ratios mean something.
double weight(const StepBench& bench, const std::string& step) {
  const routine::ExpectedTime time = routine::expected_time(step, bench.calibration.settings());
  return bench.at_once ? time.drawn : time.on_rig_s;
}

/// Takes the first of what `open` says is left until nothing is.
std::optional<calibration_report::RefusedStep> take(const StepBench& bench,
                                                    const std::function<Steps()>& open) {
  Progress progress(bench.context.console, "calibrating");
  double done = 0.0;
  for (Steps left = open(); !left.empty(); left = open()) {
    bench.context.check_stop();
    const std::string& step = left.front();
    const PhaseTimer timer(bench.context.console, step);
    double all = done;
    for (const std::string& each : left) all += weight(bench, each);
    const double its = weight(bench, step);
    const auto show = [&](const routine::Progress& now) {
      progress.update((done + now.fraction * its) / all, fmt::format("{}: {}", now.step, now.what));
    };
    try {
      bench.calibration.take(step, bench.devices, show, bench.context.stop);
    } catch (const calibration::StepRefused& refused) {
      return calibration_report::RefusedStep{step, refused.what()};
    } catch (const std::invalid_argument& error) {
      throw UsageError(error.what());  // a step named by --only whose inputs are missing
    }
    done += its;
  }
  return std::nullopt;
}

}  // namespace

std::optional<calibration_report::RefusedStep> take_steps(const StepBench& bench,
                                                          const Steps& steps) {
  auto next = steps.begin();
  bool first = true;
  return take(bench, [&] {
    if (!first) ++next;
    first = false;
    return Steps(next, steps.end());
  });
}

std::optional<calibration_report::RefusedStep> take_open_steps(const StepBench& bench) {
  return take(bench,
              [&] { return instrument::steps_to_take(bench.calibration.archive(), now_utc()); });
}

bool passes_at_once(const RigFile& rig) {
  return rig.driver == RigFile::Driver::simulated && !rig.world.time_scale;
}

std::filesystem::path report_in(const std::filesystem::path& folder) {
  return folder / "report.html";
}

void write_calibration_report(const routine::Routine& calibration,
                              const std::filesystem::path& folder, const RigFile& rig,
                              std::vector<calibration_report::RefusedStep> refused) {
  if (calibration.archive().results.empty()) return;
  calibration_report::CalibrationReportData data;
  data.rig = rig.rig.name;
  data.archive = calibration.archive();
  data.observations = calibration_report::read_observations(data.archive, routine::Folder{folder});
  data.findings = calibration.findings();
  data.instrument = calibration.instrument();
  data.now = now_utc();
  data.refused = std::move(refused);
  files::write_text_file(report_in(folder), calibration_report::html(data), files::Overwrite::Yes);
}

}  // namespace gonio::cli
