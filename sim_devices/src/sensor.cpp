#include "sensor.h"

#include <algorithm>
#include <cmath>

#include "gonio/parallel/parallel.h"
#include "gonio/random/distributions.h"

namespace gonio::sim {
namespace {

constexpr std::size_t kPixelsPerBlock = 4096;
// The full well ends in a band of read noise: what the camera calls saturated begins below it.
constexpr double kSaturationSigmas = 4.0;

double largest_dn(const CameraOptions& options) { return std::ldexp(1.0, options.bits) - 1.0; }

std::uint16_t saturation_level(const CameraOptions& options) {
  const double full =
      options.black_level_dn +
      options.dn_per_electron * (options.full_well_e - kSaturationSigmas * options.read_noise_e);
  const double level = std::min(full, largest_dn(options));
  const double bent =
      level * (1.0 - options.nonlinearity * std::pow(level / largest_dn(options), 2.0));
  return static_cast<std::uint16_t>(std::max(1.0, std::floor(bent)));
}

}  // namespace

Sensor::Sensor(const CameraOptions& options, std::uint64_t seed, std::uint64_t noise_seed)
    : options_(options), noise_seed_(noise_seed), saturation_level_dn_(saturation_level(options)) {
  const auto pixels =
      static_cast<std::size_t>(options.width_px) * static_cast<std::size_t>(options.height_px);
  gain_.resize(pixels);
  dark_e_per_s_.resize(pixels);
  offset_e_.resize(pixels);
  const random::Key gain_key = random::make_key(seed, "camera.prnu");
  const random::Key dark_key = random::make_key(seed, "camera.dark_current");
  const random::Key offset_key = random::make_key(seed, "camera.dsnu");
  parallel::for_each_block(0, pixels, kPixelsPerBlock, [&](std::size_t begin, std::size_t end) {
    for (std::size_t pixel = begin; pixel < end; ++pixel) {
      gain_[pixel] =
          static_cast<float>(std::max(0.0, 1.0 + options.prnu * random::normal(gain_key, pixel)));
      const bool hot = random::uniform(dark_key, pixel) < options.hot_pixel_fraction;
      dark_e_per_s_[pixel] = static_cast<float>(
          options.dark_current_e_per_s * (hot ? options.hot_pixel_factor : 1.0) *
          std::exp(options.dark_current_spread * random::normal(dark_key, pixel)));
      offset_e_[pixel] = static_cast<float>(options.dsnu_e * random::normal(offset_key, pixel));
    }
  });
}

std::vector<std::uint16_t> Sensor::expose(const ElectronRates& electron_rates, double seconds,
                                          std::uint64_t frame) const {
  const random::Key shot_key = random::make_key(noise_seed_, "camera.shot_noise", frame);
  const random::Key read_key = random::make_key(noise_seed_, "camera.read_noise", frame);
  const double top = largest_dn(options_);
  std::vector<std::uint16_t> pixels(gain_.size());
  parallel::for_each_block(
      0, pixels.size(), kPixelsPerBlock, [&](std::size_t begin, std::size_t end) {
        std::vector<double> electrons(end - begin);
        std::vector<double> read_noise(end - begin);
        electron_rates(begin, electrons);
        for (std::size_t pixel = begin; pixel < end; ++pixel) {
          double& here = electrons[pixel - begin];
          here = (here * gain_[pixel] + dark_e_per_s_[pixel]) * seconds;
        }
        random::fill_poisson(shot_key, begin, electrons, electrons);
        random::fill_normal(read_key, begin, read_noise);
        for (std::size_t pixel = begin; pixel < end; ++pixel) {
          const double collected = std::min(electrons[pixel - begin], options_.full_well_e);
          const double level =
              options_.black_level_dn +
              options_.dn_per_electron * (collected + offset_e_[pixel] +
                                          options_.read_noise_e * read_noise[pixel - begin]);
          const double share = level / top;
          const double bent = level * (1.0 - options_.nonlinearity * share * share);
          // Rounded down by the conversion: a floor first is a call on processors of the baseline.
          pixels[pixel] =
              static_cast<std::uint16_t>(static_cast<int>(std::clamp(bent + 0.5, 0.0, top)));
        }
      });
  return pixels;
}

}  // namespace gonio::sim
