#include "gonio/instrument/calibration_step.h"

#include <algorithm>

namespace gonio::instrument {
namespace {

using std::chrono::hours;

constexpr hours kDay{24};
constexpr hours kWeek = 7 * kDay;
constexpr hours kMonth = 30 * kDay;
/// Until something is taken apart: a year at most.
constexpr hours kRebuild = 365 * kDay;

}  // namespace

std::span<const CalibrationStep> calibration_steps() {
  static const std::vector<CalibrationStep> steps{
      {"homing", "home marks and repeatability of the axes", {}, {}, kDay},
      // The play itself is in nothing: it is at most the overshoot of every move.
      {"backlash", "play of the axes", {}, {"homing"}, kMonth},
      {"settle_time", "how long the axes ring after a move", {}, {"homing"}, kMonth},
      {"warm_up", "the lamp's warm-up and drift", {}, {}, kDay},
      {"darks", "offset and dark current of every pixel", {}, {}, kWeek},
      // Sweeps and pictures bring darks of their own: those of the week say which pixels to leave.
      {"linearity", "response curve and shutter offset", {}, {"darks"}, kMonth},
      // After the curve: with the bend known, the gain needs no term of its own for it and is twice
      // as sure.
      {"photon_transfer",
       "gain, read noise, full well, PRNU, DSNU",
       {"linearity"},
       {"darks"},
       kMonth},
      {"bad_pixels", "pixels that are not used", {}, {"darks"}, kMonth},
      {"intrinsics",
       "focal length, principal point, distortion",
       {},
       {"bad_pixels"},
       kRebuild,
       {"board_square_mm"}},
      {"stage_axes",
       "the axes and the camera's pose",
       {"intrinsics"},
       {"backlash"},
       kRebuild,
       {"board_square_mm"}},
      // Looks at nothing: what the operator says of the datum.
      {"sample_plane",
       "plane and normal of a sample",
       {"stage_axes"},
       {},
       kMonth,
       {"sample_raised_mm", "u_sample_raised_mm"}},
      {"lamp_arm",
       "the lamp's place over its arc",
       {"stage_axes"},
       {"homing", "backlash"},
       kRebuild,
       {"mirror_raised_mm", "u_mirror_raised_mm"}},
      {"zero_offsets",
       "zeros of the axes from mirror peaks",
       {"lamp_arm", "sample_plane"},
       {"homing", "backlash"},
       kMonth},
      {"flat_field",
       "the lamp's field and the lens' falloff",
       {"linearity", "zero_offsets"},
       {"warm_up"},
       kMonth},
      // Trap and chart keep the white's constants of their day: a lamp ages, what was seen in its
      // light does not.
      {"stray_light", "light that comes by other ways", {}, {"flat_field"}, kRebuild},
      {"white",
       "the instrument constant on the white reference",
       {"flat_field"},
       {"stray_light", "warm_up"},
       kDay},
      {"colour", "the colour matrix", {}, {"white"}, kRebuild, {"colour_chart"}},
      {"verification",
       "that all of it holds at other poses",
       {"white", "zero_offsets"},
       {},
       kDay,
       {"black_glass_index"}}};
  return steps;
}

const CalibrationStep* find_calibration_step(std::string_view name) {
  const auto steps = calibration_steps();
  const auto found = std::find_if(steps.begin(), steps.end(),
                                  [&](const CalibrationStep& step) { return step.name == name; });
  return found == steps.end() ? nullptr : &*found;
}

}  // namespace gonio::instrument
