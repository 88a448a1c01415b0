#pragma once

#include <chrono>

#include "gonio/calibration/routine/routine.h"
#include "gonio/sim/sim_options.h"
#include "hidden_bench.h"

namespace gonio::calibration::routine::test {

/// When the finished run is taken.
constexpr instrument::UtcSeconds kCalibrated{std::chrono::seconds(1'700'000'000)};

/// One calibration from the first step to the last of one hidden world at a quarter of the pixels,
/// which many tests look at: it takes the better part of a minute.
struct FinishedRun {
  sim::SimOptions truth;  ///< as it was calibrated
  Folder folder;
};

/// The same for the life of the process, taken by the first that asks.
const FinishedRun& finished_run();

/// Its world on another day: the lamp is warm, the noise another.
sim::SimOptions another_day();

/// Goes on from a run's folder, with fewer frames; what is taken anew is stored there.
Routine reopened(const FinishedRun& run);

/// The same in a copy of its folder, at another time.
Routine reopened(const Folder& folder, instrument::UtcSeconds now,
                 RoutineSettings settings = HiddenBench::settings());

}  // namespace gonio::calibration::routine::test
