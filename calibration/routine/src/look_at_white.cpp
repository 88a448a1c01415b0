// Radiometry: white, trap, chart and black glass under all channels.

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <stdexcept>

#include "gonio/brdf/directions.h"
#include "gonio/calibration/result/step_refused.h"
#include "gonio/instrument/measurement_equation.h"
#include "look.h"
#include "mirror.h"

namespace gonio::calibration::routine {
namespace {

constexpr double kWhiteLevel = 0.75;  // of saturation
constexpr double kUsedShare = 0.9;    // of the target's half width, clear of its edge
// Squares a side over the white. Falloff, field and distance bend over a square, and its mean is
// taken as the value in its middle: squares of 30 mm would be 0.15 % too dark, these 0.01 %.
constexpr int kParts = 12;
constexpr int kMaxColours = 3;
constexpr double kGlassLevel = 0.6;  // of saturation
constexpr double kImageRadii = 2.0;  // of the lamp's image: what holds all of its light

struct Pose {
  double arm_deg;
  double azimuth_deg;
  double tilt_deg;
};

/// The reference: seen along the normal, lit at 45 deg, where certificates hold best.
constexpr Pose kReference{45.0, 0.0, 0.0};

rig::Joints joints_of(const Bench& bench, const Pose& pose) {
  return bench.joints(Angle::from_degrees(pose.arm_deg), Angle::from_degrees(pose.azimuth_deg),
                      Angle::from_degrees(pose.tilt_deg));
}

/// One picture of the mounted target per channel, as values over a square.
void add_views(Bench& bench, const rig::Joints& commanded, const Square& square, double level,
               std::vector<WhiteView>& views) {
  if (!bench.allowed(commanded)) return;
  const rig::Joints stood = bench.go(commanded);
  const int colours = std::min<int>(kMaxColours, static_cast<int>(bench.channels().size()));
  for (int channel = 0; channel < colours; ++channel) {
    const std::string& name = bench.channels()[static_cast<std::size_t>(channel)].name;
    bench.light(name);
    const Picture picture =
        bench.picture(name, bench.exposure_for(level), bench.settings().white_frames);
    WhiteView view{stood, channel, picture.monitor, bench.signals(picture, stood, square),
                   picture.exposure_s};
    if (view.pixels.empty()) {
      throw StepRefused(fmt::format(
          "found no part of the target in the picture with lamp_arm {:g}, azimuth {:g}, tilt {:g} "
          "deg, expected it to be lit and seen",
          commanded[bench.axis("lamp_arm")].degrees(), commanded[bench.axis("azimuth")].degrees(),
          commanded[bench.axis("tilt")].degrees()));
    }
    views.push_back(std::move(view));
  }
  bench.devices().close_shutter();
}

void look_at_lamp_in_mirror(Bench& bench, std::vector<geometry::MirrorView>& views) {
  MirrorSight mirror(bench, false);
  for (const double arm_deg : {25.0, 52.0, 78.0, 110.0, 137.0}) {  // at none was it found
    const rig::Joints stood = bench.go(mirror.bisecting(Angle::from_degrees(arm_deg)));
    if (const auto image = mirror.look()) views.push_back({stood, image->pixel, false});
  }
}

void look_at_black_glass(Bench& bench, std::vector<GlassView>& views) {
  bench.devices().mount(devices::Target::black_glass);
  bench.light(bench.main_channel());
  std::vector<GlassView> seen;
  for (const double incidence_deg : {30.0, 56.7, 70.0}) {
    const Angle arm = Angle::from_degrees(2.0 * incidence_deg);
    const rig::Joints stood = bench.go(bench.joints(arm, 0.5 * arm, {}));
    const std::chrono::nanoseconds exposure = bench.exposure_for(kGlassLevel);
    const auto image = find_highlight(bench.frame(exposure), bench.bad_pixels(),
                                      bench.instrument().sensor.black_level_dn,
                                      lamp_image_radius_px(bench.instrument()));
    if (!image) {
      throw StepRefused(fmt::format(
          "black glass: found no image of the lamp at {:g} deg, expected one: is it in the holder?",
          incidence_deg));
    }
    // The lamp's own light and no other: what the glass scatters lies under it, and around it.
    const Picture picture =
        bench.picture(bench.main_channel(), exposure, bench.settings().white_frames);
    const double light = bench.light_within(picture, image->pixel, kImageRadii * image->radius_px);
    seen.push_back({stood, image->pixel, light / picture.monitor});
  }
  views = std::move(seen);
}

/// Throws StepRefused when what is mounted shows the lamp's image: mirror and glass are as dark as
/// a trap wherever they do not.
void require_no_mirror(Bench& bench) {
  bench.light(bench.main_channel());
  const Angle arm = Angle::from_degrees(60.0);
  const rig::Joints stood = bench.go(bench.joints(arm, 0.5 * arm, {}));
  const double radius_px = lamp_image_radius_px(bench.instrument());
  const auto image =
      find_highlight(bench.frame(bench.exposure_for(kGlassLevel)), bench.bad_pixels(),
                     bench.instrument().sensor.black_level_dn, radius_px);
  constexpr double kNear = 4.0;  // images' radii
  if (!image || (image->pixel - bench.middle(stood)).norm() > kNear * radius_px) return;
  throw StepRefused(fmt::format(
      "found an image of the lamp at pixel ({:.0f}, {:.0f}), expected a black trap: is a mirror or "
      "glass in the holder?",
      image->pixel.x(), image->pixel.y()));
}

/// Joints that show light and camera exchanged at the middle of the white, as the calibrated rig
/// has it; `otherwise` where there are none. Seen in a mirror, which is the same to a white: else
/// the tilt would have to be the other way, for which axes have little room.
rig::Joints exchanged(const Bench& bench, const rig::Joints& stood, const rig::Joints& otherwise) {
  const instrument::Instrument& known = bench.instrument();
  const auto seen = rig::forward(known.rig, stood).directions_at(Eigen::Vector3d::Zero());
  brdf::HalfDiff direction = brdf::half_diff_from_directions({seen.wo, seen.wi});
  direction.phi_d = -direction.phi_d;
  // By branch A alone: the reciprocal one would be the pose that there was.
  const auto reach = rig::Inverse(known.rig, {.reciprocal = false}).solve(direction);
  for (const rig::PoseSolution& pose : reach.poses) {
    if (bench.allowed(pose.joints)) return pose.joints;
  }
  return otherwise;
}

}  // namespace

Observations look_at_flat_field(Bench& bench) {
  bench.devices().mount(devices::Target::white);
  const std::vector<Pose> poses{{20.0, 0.0, 0.0},   {20.0, 25.0, 15.0}, {20.0, -25.0, 0.0},
                                {45.0, 0.0, 0.0},   {45.0, 30.0, 0.0},  {45.0, 10.0, 25.0},
                                {45.0, 45.0, 15.0}, {70.0, 20.0, 0.0},  {70.0, 40.0, 20.0},
                                {70.0, 30.0, 40.0}, {95.0, 45.0, 0.0},  {95.0, 50.0, 25.0}};
  Observations seen;
  const Square square{kUsedShare * bench.settings().target_half_width_mm, kParts};
  for (std::size_t i = 0; i < poses.size(); ++i) {
    bench.tell("pose", i, poses.size());
    add_views(bench, joints_of(bench, poses[i]), square, kWhiteLevel, seen.whites);
  }
  return seen;
}

Observations look_at_stray_light(Bench& bench) {
  bench.devices().mount(devices::Target::black_trap);
  require_no_mirror(bench);
  const std::vector<Pose> poses{{20.0, 0.0, 0.0}, {45.0, 20.0, 10.0}, {90.0, 30.0, 20.0}};
  Observations seen;
  const Square square{0.6 * bench.settings().target_half_width_mm, 1};
  for (std::size_t i = 0; i < poses.size(); ++i) {
    bench.tell("pose", i, poses.size());
    const rig::Joints commanded = joints_of(bench, poses[i]);
    if (!bench.allowed(commanded)) continue;
    const rig::Joints stood = bench.go(commanded);
    for (std::size_t channel = 0;
         channel < std::min<std::size_t>(kMaxColours, bench.channels().size()); ++channel) {
      // Next to nothing comes back from a trap: the longest exposure that what surrounds it allows.
      const std::string& name = bench.channels()[channel].name;
      bench.light(name);
      const Picture picture =
          bench.picture(name, bench.exposure_for(kWhiteLevel), bench.settings().white_frames);
      seen.whites.push_back({stood, static_cast<int>(channel), picture.monitor,
                             bench.signals(picture, stood, square), picture.exposure_s});
    }
    bench.devices().close_shutter();
  }
  return seen;
}

Observations look_at_white(Bench& bench) {
  bench.devices().mount(devices::Target::white);
  Observations seen;
  const Square square{kUsedShare * bench.settings().target_half_width_mm, kParts};
  for (std::size_t take = 0; take < 2; ++take) {
    bench.tell("take", take, 2);
    add_views(bench, joints_of(bench, kReference), square, kWhiteLevel, seen.whites);
  }
  return seen;
}

Observations look_at_colour(Bench& bench) {
  Observations seen;
  const ChartSpec& chart = bench.settings().chart;
  if (chart.linear_srgb.empty() || bench.channels().size() < kMaxColours) return seen;
  seen.chart = chart.linear_srgb;
  bench.devices().mount(devices::Target::colour_chart);
  const rig::Joints stood = bench.go(joints_of(bench, kReference));
  const int rows = static_cast<int>(chart.linear_srgb.size()) / chart.columns;
  const double pitch = chart.patch_mm + chart.gap_mm;
  for (int channel = 0; channel < kMaxColours; ++channel) {
    bench.tell("channel", static_cast<std::size_t>(channel), kMaxColours);
    const std::string& name = bench.channels()[static_cast<std::size_t>(channel)].name;
    bench.light(name);
    const Picture picture =
        bench.picture(name, bench.exposure_for(kWhiteLevel), bench.settings().white_frames);
    WhiteView view{stood, channel, picture.monitor, {}, picture.exposure_s};
    for (int patch = 0; patch < static_cast<int>(chart.linear_srgb.size()); ++patch) {
      const Eigen::Vector2d centre((patch % chart.columns - 0.5 * (chart.columns - 1)) * pitch,
                                   (0.5 * (rows - 1) - patch / chart.columns) * pitch);
      const auto signal = bench.signal_at(picture, stood, centre, 0.35 * chart.patch_mm);
      if (!signal) {
        throw StepRefused(fmt::format(
            "colour chart: found patch {} outside the picture, expected all of it in view", patch));
      }
      view.pixels.push_back(*signal);
    }
    seen.whites.push_back(std::move(view));
  }
  bench.devices().close_shutter();
  return seen;
}

Observations look_at_verification(Bench& bench) {
  Observations seen;
  // A part that shows nothing is a finding here: the others say why.
  const auto look_for = [&](const auto& part) {
    try {
      part();
    } catch (const StepRefused& refused) {
      seen.unseen.emplace_back(refused.what());
    }
  };
  bench.devices().mount(devices::Target::white);
  const Square square{kUsedShare * bench.settings().target_half_width_mm, kParts};
  // Not the poses of the flat field. The sixth is nominally the fifth with light and camera
  // exchanged; the last is the first again. The mirror takes a lamp arm that is off
  // for half as much of the azimuth: the first and third, lit from far to either side, tell them
  // apart.
  const std::vector<Pose> poses{{70.0, -4.0, 8.0},   {60.0, 15.0, 30.0}, {15.0, 72.0, 0.0},
                                {110.0, 55.0, 10.0}, {50.0, 5.0, 12.0},  {50.0, 45.0, 12.0},
                                {70.0, -4.0, 8.0}};
  constexpr std::size_t kExchanged = 5;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    bench.tell("white pose", i, poses.size());
    rig::Joints joints = joints_of(bench, poses[i]);
    if (i == kExchanged && !seen.whites.empty()) {
      joints = exchanged(bench, seen.whites.back().joints, joints);
    }
    look_for([&] { add_views(bench, joints, square, kWhiteLevel, seen.whites); });
  }
  if (seen.whites.empty() && !seen.unseen.empty()) throw StepRefused(seen.unseen.front());
  look_for([&] { look_at_lamp_in_mirror(bench, seen.mirrors); });
  look_for([&] { look_at_black_glass(bench, seen.glasses); });
  bench.devices().close_shutter();
  return seen;
}

Observations look(const std::string& step, Bench& bench) {
  using Look = Observations (*)(Bench&);
  static const std::map<std::string, Look> looks{
      {"homing", look_at_homing},
      {"backlash", look_at_backlash},
      {"settle_time", look_at_settling},
      {"warm_up", look_at_warm_up},
      {"darks", look_at_darks},
      {"photon_transfer", look_at_photon_transfer},
      {"linearity", look_at_linearity},
      {"bad_pixels", look_at_bad_pixels},
      {"intrinsics", look_at_intrinsics},
      {"stage_axes", look_at_stage_axes},
      {"sample_plane", [](Bench&) { return Observations{}; }},
      {"lamp_arm", look_at_lamp_arm},
      {"zero_offsets", look_at_zero_offsets},
      {"flat_field", look_at_flat_field},
      {"stray_light", look_at_stray_light},
      {"white", look_at_white},
      {"colour", look_at_colour},
      {"verification", look_at_verification}};
  const auto found = looks.find(step);
  if (found == looks.end()) throw std::invalid_argument("no calibration step is called " + step);
  return found->second(bench);
}

}  // namespace gonio::calibration::routine
