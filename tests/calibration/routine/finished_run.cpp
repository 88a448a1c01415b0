#include "finished_run.h"

#include <chrono>
#include <string>

#include "hidden_bench.h"
#include "temporary_folder.h"

namespace gonio::calibration::routine::test {
namespace {

constexpr std::uint64_t kSeed = 1;
constexpr instrument::UtcSeconds kNoon{std::chrono::seconds(1'700'000'000)};

Routine routine_in(const Folder& folder, const RoutineSettings& settings) {
  return Routine(HiddenBench::nominal(sim::HiddenImage::small), settings, folder,
                 {{"camera", "sim"}}, [] { return kNoon; });
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

Routine reopened(const FinishedRun& run) {
  RoutineSettings settings = HiddenBench::settings();
  settings.white_frames = 1;
  return routine_in(run.folder, settings);
}

}  // namespace gonio::calibration::routine::test
