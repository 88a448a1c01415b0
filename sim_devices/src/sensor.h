#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "gonio/sim/sim_options.h"

namespace gonio::sim {

/// From light to DN: shot noise, dark current, fixed pattern, read noise, offset, quantisation.
///
/// Threads  const members from any thread.
/// Source   The linear camera model of EMVA Standard 1288, release 4.0, section 2.
class Sensor {
 public:
  /// `seed` is the sensor's own, its fixed pattern; `noise_seed` that of its temporal noise.
  Sensor(const CameraOptions& options, std::uint64_t seed, std::uint64_t noise_seed);

  /// Electrons per second from light, without the fixed pattern, of the pixels from `first` on.
  /// Called from many threads at once.
  using ElectronRates = std::function<void(std::size_t first, std::span<double> rates)>;

  /// `frame`  Names the noise: the same frame of the same seed is the same to the byte.
  std::vector<std::uint16_t> expose(const ElectronRates& electron_rates, double seconds,
                                    std::uint64_t frame) const;

  std::uint16_t saturation_level_dn() const { return saturation_level_dn_; }

 private:
  CameraOptions options_;
  std::uint64_t noise_seed_;
  std::uint16_t saturation_level_dn_;
  std::vector<float> gain_;  ///< 1 + prnu
  std::vector<float> dark_e_per_s_;
  std::vector<float> offset_e_;
};

}  // namespace gonio::sim
