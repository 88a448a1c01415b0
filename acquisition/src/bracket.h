#pragma once

#include <optional>
#include <vector>

#include "gonio/acquisition/guarded_devices.h"

namespace gonio::acquisition {

/// The part of the image that counts: pixel indices of nine regions of the target, by position on
/// it. Exposures are judged there and nowhere else.
using Regions = std::vector<std::vector<std::size_t>>;

/// Regions of a square of the sample plane (3 x 3), or one region for a small patch. Bad pixels,
/// and those that see nothing or are lit from behind, belong to none; empty regions are left out.
Regions regions_of(const instrument::Instrument& instrument, const rig::RigPose& pose,
                   const Eigen::Vector2d& centre_mm, double half_width_mm, int grid = 3);

/// What a bracket found out, for the next one and for the outcome of its point.
struct BracketResult {
  std::chrono::nanoseconds start{0};  ///< a good first exposure at the same light level
  std::chrono::nanoseconds longest{0};
  int saturated_regions = 0;  ///< even at the shortest exposure
  int dark_regions = 0;       ///< not saturated, but below three sigmas even at the longest
  int regions = 0;
};

/// Takes exposures of one lit channel until the brightest region is unsaturated in the shortest and
/// the dimmest reaches the wanted precision in the longest, and archives each frame. A region that
/// stays saturated in the shortest asks for no longer one.
BracketResult take_bracket(GuardedDevices& devices, const instrument::Instrument& instrument,
                           const SessionOptions& options, const Regions& regions,
                           std::chrono::nanoseconds first_exposure, const FrameRecord& record,
                           SessionWriter& archive);

}  // namespace gonio::acquisition
