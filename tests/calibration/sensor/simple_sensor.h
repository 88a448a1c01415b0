#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "gonio/calibration/sensor/frame_view.h"
#include "gonio/calibration/sensor/level_statistics.h"
#include "gonio/calibration/sensor/pixel_stack.h"
#include "gonio/random/distributions.h"

namespace gonio::calibration::sensor {

/// Light and time that fill half of the well.
inline constexpr double kHalfWell_s = 0.018;
inline constexpr double kHalfWell_e_per_s = 250000.0;

/// What is hidden from the steps under test.
struct SensorTruth {
  int width_px = 128;
  int height_px = 128;
  double gain_dn_per_e = 0.39;
  double read_noise_e = 2.4;
  double full_well_e = 9000.0;  // below what 12 bits hold, so that the well is seen to end
  double black_level_dn = 64.0;
  double prnu = 0.006;
  double dsnu_e = 1.2;
  double dark_current_e_per_s = 5.0;
  double dark_current_spread = 0.0;
  double nonlinearity = 0.0;  // of level / top, squared
  double gamma = 1.0;
  double shutter_offset_s = 0.0;
};

/// A frame that owns its pixels.
struct OwnedFrame {
  std::vector<std::uint16_t> pixels_dn;
  int width_px = 0;
  int height_px = 0;
  double exposure_s = 0.0;

  FrameView view() const { return {pixels_dn, width_px, height_px, exposure_s}; }
};

/// A sensor for the tests alone: Poisson electrons, normal read noise, rounding to 12 bits. It
/// shares no code with the simulated rig.
class SimpleSensor {
 public:
  static constexpr double kTop_dn = 4095.0;

  SimpleSensor(const SensorTruth& truth, std::uint64_t seed) : truth_(truth), seed_(seed) {
    const auto pixels = static_cast<std::size_t>(truth.width_px * truth.height_px);
    gain_.resize(pixels);
    offset_e_.resize(pixels);
    dark_.resize(pixels);
    for (std::size_t p = 0; p < pixels; ++p) {
      gain_[p] = 1.0 + truth.prnu * random::normal(random::make_key(seed, "prnu"), p);
      offset_e_[p] = truth.dsnu_e * random::normal(random::make_key(seed, "dsnu"), p);
      dark_[p] =
          truth.dark_current_e_per_s *
          std::exp(truth.dark_current_spread * random::normal(random::make_key(seed, "dark"), p));
    }
  }

  const SensorTruth& truth() const { return truth_; }
  std::size_t pixels() const { return gain_.size(); }
  double& response(std::size_t pixel) { return gain_[pixel]; }
  double& dark_e_per_s(std::size_t pixel) { return dark_[pixel]; }
  /// Random telegraph noise: half of the frames have this many electrons more.
  void blink(std::size_t pixel, double electrons) { blinking_.push_back({pixel, electrons}); }

  /// Electrons per second and pixel from light; `shape` multiplies it, by pixel.
  OwnedFrame expose(double exposure_s, double light_e_per_s,
                    const std::function<double(std::size_t)>& shape = nullptr) {
    const std::uint64_t frame = next_frame_++;
    std::vector<double> electrons(pixels());
    std::vector<double> noise(pixels());
    const bool open = light_e_per_s > 0.0;
    for (std::size_t p = 0; p < pixels(); ++p) {
      const double light = light_e_per_s * gain_[p] * (shape ? shape(p) : 1.0);
      electrons[p] =
          light * (exposure_s + (open ? truth_.shutter_offset_s : 0.0)) + dark_[p] * exposure_s;
    }
    random::fill_poisson(random::make_key(seed_, "shot", frame), 0, electrons, electrons);
    random::fill_normal(random::make_key(seed_, "read", frame), 0, noise);
    for (std::size_t b = 0; b < blinking_.size(); ++b) {
      const bool up = random::uniform(random::make_key(seed_, "rts", frame), b) < 0.5;
      if (up) electrons[blinking_[b].pixel] += blinking_[b].electrons;
    }
    OwnedFrame out{std::vector<std::uint16_t>(pixels()), truth_.width_px, truth_.height_px,
                   exposure_s};
    for (std::size_t p = 0; p < pixels(); ++p) {
      const double e = std::min(electrons[p], truth_.full_well_e) + offset_e_[p] +
                       truth_.read_noise_e * noise[p];
      double level = truth_.black_level_dn + truth_.gain_dn_per_e * e;
      level *= 1.0 - truth_.nonlinearity * std::pow(level / kTop_dn, 2.0);
      if (truth_.gamma != 1.0) {
        level = kTop_dn * std::pow(std::max(level, 0.0) / kTop_dn, 1.0 / truth_.gamma);
      }
      out.pixels_dn[p] =
          static_cast<std::uint16_t>(std::clamp(std::floor(level + 0.5), 0.0, kTop_dn));
    }
    return out;
  }

  LevelStatistics level(double exposure_s, double light_e_per_s,
                        const std::function<double(std::size_t)>& shape = nullptr) {
    const OwnedFrame a = expose(exposure_s, light_e_per_s, shape);
    const OwnedFrame b = expose(exposure_s, light_e_per_s, shape);
    return level_statistics(a.view(), b.view(), {});
  }

  /// A sweep of exposures: `levels` of them, evenly to `top_e` electrons at 20 ms.
  std::vector<LevelStatistics> sweep(int levels, double top_e,
                                     const std::function<double(std::size_t)>& shape = nullptr) {
    constexpr double kLongest_s = 0.02;
    std::vector<LevelStatistics> out;
    for (int k = 1; k <= levels; ++k) {
      out.push_back(level(kLongest_s * k / levels, top_e / kLongest_s, shape));
    }
    return out;
  }

  std::vector<LevelStatistics> dark_levels(std::span<const double> exposures_s) {
    std::vector<LevelStatistics> out;
    for (const double exposure : exposures_s) out.push_back(level(exposure, 0.0));
    return out;
  }

  PixelStack stack(int frames, double exposure_s, double light_e_per_s,
                   const std::function<double(std::size_t)>& shape = nullptr) {
    PixelStack out(truth_.width_px, truth_.height_px, exposure_s, kTop_dn);
    for (int f = 0; f < frames; ++f) out.add(expose(exposure_s, light_e_per_s, shape).view());
    return out;
  }

 private:
  struct Blinking {
    std::size_t pixel;
    double electrons;
  };
  SensorTruth truth_;
  std::uint64_t seed_;
  std::uint64_t next_frame_ = 0;
  std::vector<double> gain_;
  std::vector<double> offset_e_;
  std::vector<double> dark_;
  std::vector<Blinking> blinking_;
};

}  // namespace gonio::calibration::sensor
