#pragma once

#include <string>

#include "bench.h"
#include "gonio/calibration/routine/observations.h"

namespace gonio::calibration::routine {

// One function per step: mounts its target, looks, reduces frames to what the fit takes. Each
// throws as Bench and GuardedDevices do, and StepRefused where what is seen is not its target.

Observations look_at_homing(Bench& bench);
Observations look_at_backlash(Bench& bench);  ///< a rig without approach_overshoot
Observations look_at_settling(Bench& bench);

Observations look_at_warm_up(Bench& bench);
Observations look_at_darks(Bench& bench);
Observations look_at_photon_transfer(Bench& bench);
Observations look_at_linearity(Bench& bench);
Observations look_at_bad_pixels(Bench& bench);

Observations look_at_intrinsics(Bench& bench);
Observations look_at_stage_axes(Bench& bench);
Observations look_at_lamp_arm(Bench& bench);
Observations look_at_zero_offsets(Bench& bench);

Observations look_at_flat_field(Bench& bench);
Observations look_at_stray_light(Bench& bench);
Observations look_at_white(Bench& bench);
Observations look_at_colour(Bench& bench);
Observations look_at_verification(Bench& bench);

/// By the step's name. Steps that look at nothing (sample_plane) give empty observations. Throws
/// std::invalid_argument for a step that is none.
Observations look(const std::string& step, Bench& bench);

}  // namespace gonio::calibration::routine
