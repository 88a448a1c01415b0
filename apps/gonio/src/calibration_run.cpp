#include "calibration_run.h"

#include <fmt/format.h>

#include <chrono>
#include <functional>
#include <stdexcept>
#include <utility>

#include "calibration_setup.h"
#include "gonio/calibration/result/step_refused.h"
#include "gonio/errors/errors.h"
#include "gonio/files/text_file.h"
#include "gonio/setup/simulated_rig.h"

namespace gonio::cli {

namespace routine = calibration::routine;

instrument::UtcSeconds now_utc() {
  return std::chrono::floor<std::chrono::seconds>(std::chrono::system_clock::now());
}

routine::Routine calibration_in(const std::filesystem::path& folder, const RigFile& rig,
                                routine::RoutineSettings settings, OpenedRig& opened) {
  return blame(folder.string(), [&] {
    return routine::Routine(nominal_instrument(rig), std::move(settings), routine::Folder{folder},
                            serials_of(opened), now_utc);
  });
}

namespace {

using Steps = std::vector<std::string>;

/// Takes the first of what `open` says is left until nothing is.
std::optional<calibration_report::RefusedStep> take(const Context& context,
                                                    routine::Routine& calibration,
                                                    const acquisition::DeviceSet& devices,
                                                    const std::function<Steps()>& open) {
  Progress progress(context.console, "calibrating");
  std::size_t done = 0;
  for (Steps left = open(); !left.empty(); left = open(), ++done) {
    context.check_stop();
    const std::string& step = left.front();
    const PhaseTimer timer(context.console, step);
    const auto show = [&](const routine::Progress& now) {
      progress.update(
          (static_cast<double>(done) + now.fraction) / static_cast<double>(done + left.size()),
          fmt::format("{}: {}", now.step, now.what));
    };
    try {
      calibration.take(step, devices, show, context.stop);
    } catch (const calibration::StepRefused& refused) {
      return calibration_report::RefusedStep{step, refused.what()};
    } catch (const std::invalid_argument& error) {
      throw UsageError(error.what());  // a step named by --only whose inputs are missing
    }
  }
  return std::nullopt;
}

}  // namespace

std::optional<calibration_report::RefusedStep> take_steps(const Context& context,
                                                          routine::Routine& calibration,
                                                          const acquisition::DeviceSet& devices,
                                                          const Steps& steps) {
  auto next = steps.begin();
  bool first = true;
  return take(context, calibration, devices, [&] {
    if (!first) ++next;
    first = false;
    return Steps(next, steps.end());
  });
}

std::optional<calibration_report::RefusedStep> take_open_steps(
    const Context& context, routine::Routine& calibration, const acquisition::DeviceSet& devices) {
  return take(context, calibration, devices,
              [&] { return instrument::steps_to_take(calibration.archive(), now_utc()); });
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
  files::write_text_file(folder / "report.html", calibration_report::html(data),
                         files::Overwrite::Yes);
}

}  // namespace gonio::cli
