#pragma once

#include <vector>

#include "bracket_rules.h"
#include "gonio/acquisition/guarded_devices.h"

namespace gonio::acquisition {

/// The part of the image that counts: pixel indices of nine regions of the target, by position on
/// it. Exposures are judged there and nowhere else.
using Regions = std::vector<std::vector<std::size_t>>;

/// Regions of a square of the sample plane (3 x 3), or one region for a small patch. Bad pixels,
/// and those that see nothing or are lit from behind, belong to none; empty regions are left out.
Regions regions_of(const instrument::Instrument& instrument, const rig::RigPose& pose,
                   const Eigen::Vector2d& centre_mm, double half_width_mm, int grid = 3);

/// Takes the exposures of one lit channel that bracket_exposures() asks for and archives each
/// frame.
BracketResult take_bracket(GuardedDevices& devices, const instrument::Instrument& instrument,
                           const SessionOptions& options, const Regions& regions,
                           std::chrono::nanoseconds first_exposure, const FrameRecord& record,
                           SessionWriter& archive);

}  // namespace gonio::acquisition
