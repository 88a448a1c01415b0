#include "finished_run.h"

#include <string>

#include "hidden_bench.h"
#include "temporary_folder.h"

namespace gonio::calibration::routine::test {
namespace {

constexpr std::uint64_t kSeed = 1;

Routine routine_in(const Folder& folder, const RoutineSettings& settings,
                   instrument::UtcSeconds now = kCalibrated) {
  return Routine(HiddenBench::nominal(sim::HiddenImage::small), settings, folder,
                 {{"camera", "sim"}}, [now] { return now; });
}

FinishedRun run_in(const Folder& folder) {
  HiddenBench bench(kSeed);
  Routine routine = routine_in(folder, HiddenBench::settings());
  for (const instrument::CalibrationStep& step : instrument::calibration_steps()) {
    routine.take(std::string(step.name), bench.devices, {}, {});
  }
  return {bench.world.truth(), folder};
}

}  // namespace

const FinishedRun& finished_run() {
  static const TemporaryFolder temporary;
  static const FinishedRun run = run_in({temporary.path() / "cal"});
  return run;
}

sim::SimOptions another_day() {
  sim::SimOptions world = finished_run().truth;
  world.lamp.on_before = std::chrono::hours(3);
  world.noise_seed = 77;
  return world;
}

Routine reopened(const FinishedRun& run) { return reopened(run.folder, kCalibrated); }

Routine reopened(const Folder& folder, instrument::UtcSeconds now, RoutineSettings settings) {
  settings.white_frames = 1;
  return routine_in(folder, settings, now);
}

}  // namespace gonio::calibration::routine::test
