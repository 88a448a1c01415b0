// What the camera does with light and without, on the white that faces it.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "gonio/calibration/result/step_refused.h"
#include "gonio/calibration/sensor/darks.h"
#include "gonio/calibration/sensor/pixel_stack.h"
#include "look.h"

namespace gonio::calibration::routine {
namespace {

using std::chrono::duration;
using std::chrono::nanoseconds;

constexpr double kBright = 0.9;            // of saturation: the top of a sweep
constexpr double kHalf = 0.5;              // of a stack for the pixels' own response
constexpr double kFaintest = 0.005;        // of the bright exposure
constexpr double kBeyondSaturation = 1.3;  // of it, so that the variance is seen to fall
constexpr double kRegionOfTarget = 0.85;   // half width of what is looked at, of the target's
constexpr std::chrono::seconds kTick{1};

nanoseconds times(nanoseconds exposure, double factor) {
  return nanoseconds(std::llround(static_cast<double>(exposure.count()) * factor));
}

sensor::FrameView view_of(const devices::Frame& frame) {
  return {frame.pixels_dn, frame.width_px, frame.height_px,
          duration<double>(frame.exposure).count()};
}

/// Square about the middle, within the target.
sensor::Region region_on_target(const Bench& bench, double share) {
  const auto& camera = bench.instrument().camera;
  const rig::Joints pose = bench.joints(Angle::from_degrees(45.0), {}, {});
  const double distance_mm =
      rig::forward(bench.instrument().rig, pose).world_from_camera.translation().norm();
  const int half =
      static_cast<int>(share * bench.settings().target_half_width_mm / distance_mm * camera.fx_px);
  const Eigen::Vector2d middle = bench.middle(pose);
  const int left = std::max(0, static_cast<int>(middle.x()) - half);
  const int top = std::max(0, static_cast<int>(middle.y()) - half);
  return {left, top, std::min(2 * half, camera.width_px - left),
          std::min(2 * half, camera.height_px - top), 1};
}

/// Throws StepRefused for what is no white: means over blocks of the region differ much, or it is
/// far from the brightest thing in the picture, which the exposure was chosen by.
void require_white(const Bench& bench, const devices::Frame& frame, double level) {
  constexpr int kBlocks = 8;     // along an edge
  constexpr double kEven = 0.5;  // darkest block of the brightest
  constexpr double kLit = 0.25;  // brightest block of what was exposed for
  const sensor::Region region = region_on_target(bench, kRegionOfTarget);
  const int height = region.height_px / kBlocks;
  const int width = region.width_px / kBlocks;
  double darkest = frame.saturation_level_dn;
  double brightest = 0.0;
  for (int block = 0; block < kBlocks * kBlocks; ++block) {
    const int top = region.row + block / kBlocks * height;
    const int left = region.column + block % kBlocks * width;
    double sum = 0.0;
    for (int row = top; row < top + height; ++row) {
      for (int column = left; column < left + width; ++column) sum += frame.at(row, column);
    }
    const double above = sum / (height * width) - bench.instrument().sensor.black_level_dn;
    darkest = std::min(darkest, above);
    brightest = std::max(brightest, above);
  }
  const double wanted = level * (bench.saturation_dn() - bench.instrument().sensor.black_level_dn);
  if (brightest >= kLit * wanted && darkest >= kEven * brightest) return;
  throw StepRefused(fmt::format(
      "found {:.0f} to {:.0f} DN above black over the target, expected an even white that is the "
      "brightest thing in the picture ({:.0f} DN): is the white mounted, clean and wholly lit?",
      darkest, brightest, wanted));
}

/// The white, facing the camera, lit from 45 deg in the main channel: the exposure that brings it
/// to `level` of saturation.
nanoseconds light_white(Bench& bench, double level) {
  bench.light(bench.main_channel());
  const nanoseconds exposure = bench.exposure_for(level);
  require_white(bench, bench.frame(exposure), level);
  return exposure;
}

void face_white(Bench& bench) {
  bench.devices().mount(devices::Target::white);
  bench.go(bench.joints(Angle::from_degrees(45.0), {}, {}));
}

sensor::LevelStatistics level(Bench& bench, nanoseconds exposure) {
  const devices::Frame first = bench.frame(exposure);
  const devices::Frame second = bench.frame(exposure);
  sensor::LevelOptions options;
  options.region = region_on_target(bench, kRegionOfTarget);
  options.bad_pixels = bench.bad_pixels();
  options.saturation_dn = bench.saturation_dn();
  return sensor::level_statistics(view_of(first), view_of(second), options);
}

sensor::PixelStack stack(Bench& bench, nanoseconds exposure, int frames) {
  std::optional<sensor::PixelStack> taken;
  for (int i = 0; i < frames; ++i) {
    const devices::Frame frame = bench.frame(exposure);
    if (!taken) {
      taken.emplace(frame.width_px, frame.height_px, view_of(frame).exposure_s,
                    bench.saturation_dn());
    }
    taken->add(view_of(frame));
  }
  return std::move(*taken);
}

/// The i-th of `count` places when every other one is taken on the way up and the rest on the way
/// down: a lamp that drifts meanwhile then scatters neighbours and does not bend the whole.
int up_and_down(int i, int count) {
  const int up = (count + 1) / 2;
  return i < up ? 2 * i : 2 * (count - 1 - i) + 1;
}

/// Dark levels and lit ones at exposures that rise from faint to `top` of the bright one.
Observations sweep(Bench& bench, double top) {
  Observations seen;
  face_white(bench);
  const nanoseconds bright = light_white(bench, kBright);
  const nanoseconds shortest = bench.devices().devices().camera->info().min_exposure;
  const nanoseconds first = std::max(shortest, times(bright, kFaintest));
  const int count = bench.settings().light_levels;
  const double ratio =
      static_cast<double>(times(bright, top).count()) / static_cast<double>(first.count());
  seen.levels.resize(static_cast<std::size_t>(count));
  for (int i = 0; i < count; ++i) {
    bench.tell("light level", static_cast<std::size_t>(i), static_cast<std::size_t>(count));
    const int place = up_and_down(i, count);
    // Linear in the exposure but for the faint end, where steps of a factor tell the offset.
    const double even = static_cast<double>(place) / (count - 1);
    const double share = 0.5 * (even + std::pow(ratio, even - 1.0));
    seen.levels[static_cast<std::size_t>(place)] =
        level(bench, std::max(first, times(bright, top * share)));
  }
  bench.devices().close_shutter();
  for (const nanoseconds exposure : {shortest, times(bright, 0.5), bright}) {
    seen.dark_levels.push_back(level(bench, exposure));
  }
  return seen;
}

}  // namespace

Observations look_at_warm_up(Bench& bench) {
  Observations seen;
  face_white(bench);
  bench.light(bench.main_channel());
  const auto start = bench.devices().now();
  const nanoseconds exposure = light_white(bench, kHalf);
  const sensor::Region region = region_on_target(bench, kRegionOfTarget);
  const auto& settings = bench.settings();
  const auto all = static_cast<std::size_t>(settings.warm_up / settings.lamp_interval);
  // A lamp that still drifts at the end is waited for, up to three times as long.
  const auto drifts = [&] { return !sensor::fit_lamp_stability(seen.lamp).acceptance.passed(); };
  for (std::size_t i = 0; i <= all || (i <= 3 * all && drifts()); ++i) {
    bench.tell("reading", i, std::max(i, all) + 1);
    // In short ticks: a stop request is heard within one.
    const auto due = start + static_cast<int>(i) * nanoseconds(settings.lamp_interval);
    while (bench.devices().now() < due && !bench.devices().stop_requested()) {
      bench.devices().devices().clock->wait_until(
          std::min<nanoseconds>(due, bench.devices().now() + kTick));
    }
    const devices::Frame frame = bench.frame(exposure);
    double sum = 0.0;
    for (int row = region.row; row < region.row + region.height_px; ++row) {
      for (int column = region.column; column < region.column + region.width_px; ++column) {
        sum += frame.at(row, column) - bench.instrument().sensor.black_level_dn;
      }
    }
    seen.lamp.push_back({duration<double>(frame.exposure_start - start).count(),
                         sum / (region.width_px * region.height_px)});
  }
  return seen;
}

Observations look_at_darks(Bench& bench) {
  bench.devices().close_shutter();
  const devices::CameraInfo camera = bench.devices().devices().camera->info();
  std::vector<sensor::PixelStack> stacks;
  std::vector<nanoseconds> exposures{
      std::max<nanoseconds>(camera.min_exposure, std::chrono::milliseconds(1)),
      std::min<nanoseconds>(camera.max_exposure, std::chrono::milliseconds(500)),
      std::min<nanoseconds>(camera.max_exposure, std::chrono::seconds(2))};
  // Of a camera that cannot expose for so long the last two are one.
  exposures.erase(std::unique(exposures.begin(), exposures.end()), exposures.end());
  for (const nanoseconds exposure : exposures) {
    bench.tell("exposure", stacks.size(), exposures.size());
    stacks.push_back(stack(bench, exposure, bench.settings().dark_frames));
  }
  sensor::DarkOptions options;
  options.gain_dn_per_e = bench.instrument().sensor.gain_dn_per_e;
  options.max_bad_fraction = bench.settings().max_bad_pixel_fraction;
  const sensor::Darks darks = sensor::fit_darks(stacks, options);
  Observations seen;
  seen.darks =
      DarkSummary{darks.black_level_dn, darks.dark_current_dn_per_s, darks.temporal_noise_dn,
                  darks.acceptance.at(0).found, darks.bad_fraction};
  for (std::size_t i = 0; i < darks.defects.size(); ++i) {
    if (darks.defects[i] != 0) {
      seen.defects.push_back({static_cast<std::uint32_t>(i), darks.defects[i]});
    }
  }
  return seen;
}

Observations look_at_photon_transfer(Bench& bench) {
  Observations seen = sweep(bench, kBeyondSaturation);
  bench.light(bench.main_channel());
  const nanoseconds half = bench.exposure_for(kHalf);
  const sensor::PixelStack bright = stack(bench, half, bench.settings().flat_frames);
  bench.devices().close_shutter();
  const sensor::PixelStack dark = stack(bench, half, bench.settings().flat_frames);
  seen.non_uniformity = sensor::fit_non_uniformity(
      dark, bright, region_on_target(bench, kRegionOfTarget), bench.bad_pixels());
  return seen;
}

Observations look_at_linearity(Bench& bench) { return sweep(bench, 1.0); }

Observations look_at_bad_pixels(Bench& bench) {
  face_white(bench);
  const nanoseconds half = light_white(bench, kHalf);
  const sensor::PixelStack bright = stack(bench, half, bench.settings().flat_frames);
  // Beyond the target there is nothing flat to compare a pixel with its neighbours on.
  const sensor::Region region = region_on_target(bench, 0.9);
  std::vector<double> signal;
  for (int row = region.row; row < region.row + region.height_px; ++row) {
    for (int column = region.column; column < region.column + region.width_px; ++column) {
      const auto pixel =
          static_cast<std::size_t>(row) * static_cast<std::size_t>(bright.width_px()) +
          static_cast<std::size_t>(column);
      signal.push_back(bright.mean_dn(pixel) - bench.instrument().sensor.black_level_dn);
    }
  }
  const auto marks = sensor::flat_defects(signal, region.width_px, region.height_px, 1);
  Observations seen;
  for (std::size_t i = 0; i < marks.size(); ++i) {
    if (marks[i] == 0) continue;
    const auto row = region.row + static_cast<int>(i) / region.width_px;
    const auto column = region.column + static_cast<int>(i) % region.width_px;
    seen.defects.push_back(
        {static_cast<std::uint32_t>(row * bright.width_px() + column), marks[i]});
  }
  return seen;
}

}  // namespace gonio::calibration::routine
