#include "light.h"

#include <fmt/format.h>

#include <stdexcept>

#include "gonio/random/distributions.h"

namespace gonio::sim {

std::vector<devices::LightChannel> SimLightSource::channels() const {
  std::vector<devices::LightChannel> channels;
  for (const LampChannelOptions& channel : options_.channels) {
    channels.push_back({channel.name, channel.wavelength_nm});
  }
  return channels;
}

void SimLightSource::light(const std::string& channel) {
  for (std::size_t index = 0; index < options_.channels.size(); ++index) {
    if (options_.channels[index].name == channel) {
      lit_ = static_cast<int>(index);
      return;
    }
  }
  std::string known;
  for (const LampChannelOptions& other : options_.channels) {
    known += (known.empty() ? "" : ", ") + other.name;
  }
  throw std::invalid_argument(
      fmt::format("{}: no channel \"{}\", expected one of {}", name_, channel, known));
}

SimLampMonitor::SimLampMonitor(const LampOptions& options, const SimLightSource& light,
                               const LampOutput& output, const VirtualClock& clock,
                               std::uint64_t seed)
    : light_(light),
      output_(output),
      clock_(clock),
      sigma_(options.monitor_sigma),
      key_(random::make_key(seed, "lamp.monitor")) {}

void SimLampMonitor::count_noise_from(std::uint64_t index) { readings_ = index; }

double SimLampMonitor::read() {
  const int lit = light_.lit();
  const double level = lit == SimLightSource::kDark
                           ? 0.0
                           : output_.monitored(static_cast<std::size_t>(lit), clock_.now());
  return level + sigma_ * random::normal(key_, readings_++);
}

}  // namespace gonio::sim
