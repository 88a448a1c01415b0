#pragma once

#include <atomic>
#include <string>

#include "gonio/devices/light_source.h"
#include "gonio/sim/sim_options.h"
#include "gonio/sim/virtual_clock.h"
#include "lamp_output.h"

namespace gonio::sim {

/// The lamp's switch. LEDs: light is steady at once.
class SimLightSource final : public devices::LightSource {
 public:
  static constexpr int kDark = -1;

  explicit SimLightSource(const LampOptions& options) : options_(options) {}

  const std::string& name() const override { return name_; }
  std::vector<devices::LightChannel> channels() const override;
  void light(const std::string& channel) override;
  void close_shutter() noexcept override { lit_ = kDark; }

  /// Index of the lit channel or kDark. From any thread.
  int lit() const { return lit_; }

 private:
  LampOptions options_;
  std::string name_ = "lamp";
  std::atomic<int> lit_ = kDark;
};

/// A photodiode in the lamp head.
class SimLampMonitor final : public devices::LampMonitor {
 public:
  /// The three others must outlive it.
  SimLampMonitor(const LampOptions& options, const SimLightSource& light, const LampOutput& output,
                 const VirtualClock& clock, std::uint64_t seed);

  const std::string& name() const override { return name_; }
  double read() override;
  /// Noise is drawn from this index on: SimGoniometer::begin_subject().
  void count_noise_from(std::uint64_t index);

 private:
  const SimLightSource& light_;
  const LampOutput& output_;
  const VirtualClock& clock_;
  double sigma_;
  random::Key key_;
  std::uint64_t readings_ = 0;
  std::string name_ = "lamp_monitor";
};

}  // namespace gonio::sim
