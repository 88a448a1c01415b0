#pragma once

#include <array>
#include <vector>

#include "gonio/acquisition/reduction.h"
#include "gonio/acquisition/session.h"
#include "gonio/sim/sim_goniometer.h"

namespace gonio {

/// What an operator of the nominal simulated rig would know about it: the constants of the world,
/// but not its random numbers nor the sample's tilt.
instrument::Instrument nominal_instrument(const sim::SimOptions& truth);

/// The world's devices as a session takes them.
acquisition::DeviceSet devices_of(sim::SimGoniometer& world);

/// A plan of directions given in degrees.
acquisition::MeasurementPlan plan_of(const instrument::Instrument& instrument,
                                     const std::vector<std::array<double, 3>>& directions_deg);

}  // namespace gonio
