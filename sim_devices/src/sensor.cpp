#include "sensor.h"

#include <algorithm>
#include <cmath>

#include "gonio/parallel/avx2.h"
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

/// From collected electrons to DN, of some pixels.
struct Conversion {
  double full_well_e;
  double black_level_dn;
  double dn_per_electron;
  double read_noise_e;
  double nonlinearity;
  double top_dn;
};

GONIO_INLINE void convert_loop(const Conversion& by, const double* electrons,
                               const double* read_noise, const float* offset_e, std::size_t count,
                               std::uint16_t* pixels_dn) {
  const double per_top = 1.0 / by.top_dn;
  for (std::size_t i = 0; i < count; ++i) {
    const double collected = electrons[i] < by.full_well_e ? electrons[i] : by.full_well_e;
    const double level = by.black_level_dn + by.dn_per_electron * (collected + offset_e[i] +
                                                                   by.read_noise_e * read_noise[i]);
    const double share = level * per_top;
    const double bent = level * (1.0 - by.nonlinearity * share * share) + 0.5;
    const double above = bent > 0.0 ? bent : 0.0;
    const double within = above < by.top_dn ? above : by.top_dn;
    // Rounded down by the conversion: a floor first is a call on processors of the baseline.
    pixels_dn[i] = static_cast<std::uint16_t>(static_cast<int>(within));
  }
}

GONIO_INLINE void collect_loop(const float* gain, const float* dark_e_per_s, double seconds,
                               std::size_t count, double* electrons) {
  for (std::size_t i = 0; i < count; ++i) {
    electrons[i] = (electrons[i] * gain[i] + dark_e_per_s[i]) * seconds;
  }
}

void convert(const Conversion& by, const double* electrons, const double* read_noise,
             const float* offset_e, std::size_t count, std::uint16_t* pixels_dn) {
  convert_loop(by, electrons, read_noise, offset_e, count, pixels_dn);
}
#if GONIO_WITH_AVX2
GONIO_TARGET_AVX2 void convert_avx2(const Conversion& by, const double* electrons,
                                    const double* read_noise, const float* offset_e,
                                    std::size_t count, std::uint16_t* pixels_dn) {
  convert_loop(by, electrons, read_noise, offset_e, count, pixels_dn);
}
#endif

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
  const Conversion by{options_.full_well_e,  options_.black_level_dn, options_.dn_per_electron,
                      options_.read_noise_e, options_.nonlinearity,   largest_dn(options_)};
  std::vector<std::uint16_t> pixels(gain_.size());
  parallel::for_each_block(
      0, pixels.size(), kPixelsPerBlock, [&](std::size_t begin, std::size_t end) {
        std::vector<double> electrons(end - begin);
        std::vector<double> read_noise(end - begin);
        electron_rates(begin, electrons);
        collect_loop(gain_.data() + begin, dark_e_per_s_.data() + begin, seconds, end - begin,
                     electrons.data());
        random::fill_poisson(shot_key, begin, electrons, electrons);
        random::fill_normal(read_key, begin, read_noise);
#if GONIO_WITH_AVX2
        const auto convert_all = parallel::has_avx2() ? convert_avx2 : convert;
#else
        const auto convert_all = convert;
#endif
        convert_all(by, electrons.data(), read_noise.data(), offset_e_.data() + begin, end - begin,
                    pixels.data() + begin);
      });
  return pixels;
}

}  // namespace gonio::sim
