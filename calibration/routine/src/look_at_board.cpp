// The board in many poses on the cradle.

#include <cmath>

#include "gonio/calibration/board/detect.h"
#include "gonio/calibration/result/step_refused.h"
#include "look.h"

namespace gonio::calibration::routine {
namespace {

// More slanted, markers are missed and the windows about the corners grow too narrow.
constexpr double kMaxSlant_deg = 44.0;
constexpr double kBoardLevel = 0.7;  // of saturation
constexpr double kMaxMissed = 0.2;   // of the views
const Angle kLampBeside = Angle::from_degrees(15.0);

struct Grid {
  std::vector<double> azimuths_deg;
  std::vector<double> tilts_deg;
};

std::vector<geometry::StageView> views(Bench& bench, devices::Target target, const Grid& grid) {
  bench.devices().mount(target);
  std::vector<rig::Joints> poses;
  for (const double tilt_deg : grid.tilts_deg) {
    for (const double azimuth_deg : grid.azimuths_deg) {
      const Angle azimuth = Angle::from_degrees(azimuth_deg);
      const Angle tilt = Angle::from_degrees(tilt_deg);
      const double facing = std::cos(azimuth.radians()) * std::cos(tilt.radians());
      if (facing < std::cos(Angle::from_degrees(kMaxSlant_deg).radians())) continue;
      const rig::Joints pose = bench.joints(kLampBeside, azimuth, tilt);
      if (bench.allowed(pose)) poses.push_back(pose);
    }
  }
  std::vector<geometry::StageView> seen;
  bench.light(bench.main_channel());
  std::size_t missing = 0;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    bench.tell("view", i, poses.size());
    const rig::Joints stood = bench.go(poses[i]);
    const devices::Frame frame = bench.frame(bench.exposure_for(kBoardLevel));
    try {
      const board::BoardImage image{frame.pixels_dn, frame.width_px, frame.height_px,
                                    static_cast<double>(frame.saturation_level_dn),
                                    bench.bad_pixels()};
      seen.push_back({stood, board::detect(image, bench.settings().board)});
    } catch (const StepRefused&) {
      // One view that is bad says little; the first few all being bad says what is mounted.
      if (static_cast<double>(++missing) > kMaxMissed * static_cast<double>(poses.size())) throw;
    }
  }
  return seen;
}

}  // namespace

Observations look_at_intrinsics(Bench& bench) {
  Observations seen;
  seen.boards =
      views(bench, devices::Target::board,
            {{-42.0, -30.0, -18.0, -6.0, 6.0, 18.0, 30.0, 42.0}, {-4.0, 12.0, 26.0, 40.0}});
  return seen;
}

Observations look_at_stage_axes(Bench& bench) {
  Observations seen;
  seen.boards =
      views(bench, devices::Target::board,
            {{-42.0, -30.0, -15.0, 0.0, 15.0, 30.0, 42.0}, {0.0, 10.0, 20.0, 30.0, 40.0}});
  seen.boards_turned = views(bench, devices::Target::board_turned,
                             {{-36.0, -18.0, 0.0, 18.0, 36.0}, {0.0, 14.0, 28.0}});
  return seen;
}

}  // namespace gonio::calibration::routine
