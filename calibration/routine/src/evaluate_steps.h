#pragma once

#include "gonio/calibration/routine/findings.h"
#include "result_builder.h"

namespace gonio::calibration::routine {

/// What an evaluation has besides its observations.
struct Known {
  const instrument::Instrument& nominal;
  const RoutineSettings& settings;
  /// nominal with all that earlier steps found.
  const instrument::Instrument& instrument;
};

// One per step, as evaluate(): fills its part of the findings and of the result.
using Evaluate = void (*)(const Observations& seen, const Known& known, Findings& findings,
                          ResultBuilder& result);

void evaluate_homing(const Observations&, const Known&, Findings&, ResultBuilder&);
void evaluate_backlash(const Observations&, const Known&, Findings&, ResultBuilder&);
void evaluate_settling(const Observations&, const Known&, Findings&, ResultBuilder&);
void evaluate_warm_up(const Observations&, const Known&, Findings&, ResultBuilder&);
void evaluate_darks(const Observations&, const Known&, Findings&, ResultBuilder&);
void evaluate_photon_transfer(const Observations&, const Known&, Findings&, ResultBuilder&);
void evaluate_linearity(const Observations&, const Known&, Findings&, ResultBuilder&);
void evaluate_bad_pixels(const Observations&, const Known&, Findings&, ResultBuilder&);
void evaluate_intrinsics(const Observations&, const Known&, Findings&, ResultBuilder&);
void evaluate_stage_axes(const Observations&, const Known&, Findings&, ResultBuilder&);
void evaluate_sample_plane(const Observations&, const Known&, Findings&, ResultBuilder&);
void evaluate_lamp_arm(const Observations&, const Known&, Findings&, ResultBuilder&);
void evaluate_zero_offsets(const Observations&, const Known&, Findings&, ResultBuilder&);
void evaluate_flat_field(const Observations&, const Known&, Findings&, ResultBuilder&);
void evaluate_stray_light(const Observations&, const Known&, Findings&, ResultBuilder&);
void evaluate_white(const Observations&, const Known&, Findings&, ResultBuilder&);
void evaluate_colour(const Observations&, const Known&, Findings&, ResultBuilder&);
void evaluate_verification(const Observations&, const Known&, Findings&, ResultBuilder&);

}  // namespace gonio::calibration::routine
