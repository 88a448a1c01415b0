#include "lamp_output.h"

#include <algorithm>
#include <cmath>

#include "gonio/random/distributions.h"

namespace gonio::sim {
namespace {

double factor_of(const LampEvent& event, devices::Clock::Duration time) {
  if (time < event.at) return 1.0;
  const double share =
      event.over.count() == 0
          ? 1.0
          : std::min(1.0, devices::to_seconds(time - event.at) / devices::to_seconds(event.over));
  return 1.0 + share * (event.factor - 1.0);
}

}  // namespace

LampOutput::LampOutput(const LampOptions& options, std::uint64_t seed)
    : options_(options), walks_(options.channels.size()) {
  for (std::size_t channel = 0; channel < options.channels.size(); ++channel) {
    keys_.push_back(random::make_key(seed, "lamp.drift", channel));
  }
}

double LampOutput::at(std::size_t channel, Time time) const {
  double level = without_events(channel, time);
  for (const LampEvent& event : options_.events) level *= factor_of(event, time);
  return level;
}

double LampOutput::monitored(std::size_t channel, Time time) const {
  double level = without_events(channel, time);
  for (const LampEvent& event : options_.events) {
    if (event.seen_by_monitor) level *= factor_of(event, time);
  }
  return level;
}

double LampOutput::without_events(std::size_t channel, Time time) const {
  const double since_on = devices::to_seconds(time) + devices::to_seconds(options_.on_before);
  const double warm = 1.0 - options_.warm_up_amplitude *
                                std::exp(-since_on / devices::to_seconds(options_.warm_up_tau));
  return warm * (1.0 + drift(channel, devices::to_seconds(time)));
}

double LampOutput::drift(std::size_t channel, double time_s) const {
  if (options_.drift_sigma == 0.0) return 0.0;
  const auto before = static_cast<std::size_t>(time_s);
  const double share = time_s - static_cast<double>(before);
  const double keep = std::exp(-1.0 / devices::to_seconds(options_.drift_tau));
  const double renew = options_.drift_sigma * std::sqrt(1.0 - keep * keep);

  const std::lock_guard lock(mutex_);
  std::vector<double>& walk = walks_[channel];
  if (walk.empty()) walk.push_back(options_.drift_sigma * random::normal(keys_[channel], 0));
  while (walk.size() < before + 2) {
    walk.push_back(keep * walk.back() + renew * random::normal(keys_[channel], walk.size()));
  }
  return (1.0 - share) * walk[before] + share * walk[before + 1];
}

}  // namespace gonio::sim
