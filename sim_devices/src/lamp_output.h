#pragma once

#include <mutex>
#include <vector>

#include "gonio/devices/clock.h"
#include "gonio/random/key.h"
#include "gonio/sim/sim_options.h"

namespace gonio::sim {

/// g(t): how bright each channel is over time, against its nominal intensity.
///
/// The drift is an Ornstein-Uhlenbeck walk on a grid of whole seconds, so that its value at a time
/// depends on the seed only and not on who asked before.
///
/// Threads  All members from any thread.
class LampOutput {
 public:
  using Time = devices::Clock::Duration;

  LampOutput(const LampOptions& options, std::uint64_t seed);

  double at(std::size_t channel, Time time) const;
  /// What the monitor sees of it.
  double monitored(std::size_t channel, Time time) const;

 private:
  double drift(std::size_t channel, double seconds) const;
  double without_events(std::size_t channel, Time time) const;

  LampOptions options_;
  std::vector<random::Key> keys_;  ///< per channel
  mutable std::mutex mutex_;
  mutable std::vector<std::vector<double>> walks_;  ///< per channel, one value per second, grown
};

}  // namespace gonio::sim
