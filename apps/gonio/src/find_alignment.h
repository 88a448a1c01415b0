#pragma once

#include <stop_token>
#include <string>

#include "gonio/console/console.h"
#include "gonio/instrument/alignment.h"
#include "gonio/opened_rig/opened_rig.h"
#include "gonio/setup/rig_file.h"
#include "gonio/units/angle.h"

namespace gonio::cli {

/// The rig a sample is aligned on.
struct AlignmentRig {
  const RigFile& file;
  const instrument::Instrument& constants;
  /// The constants come from a calibration: their u_normal is then how sure the normal is that the
  /// sample's leans from. On a rig by the drawing it is how far samples lean.
  bool calibrated = false;
};

/// From the mounted sample's own highlight. Throws calibration::StepRefused: a matte sample.
instrument::Alignment alignment_by_highlight(const Console& console, const AlignmentRig& rig,
                                             OpenedRig& opened, std::stop_token stop);

/// A sample that lies on the datum; `sigma` is how far its normal may lean, about each axis.
instrument::Alignment alignment_by_seat(const AlignmentRig& rig, Angle sigma);

}  // namespace gonio::cli
