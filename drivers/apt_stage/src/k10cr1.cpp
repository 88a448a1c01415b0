#include <cmath>
#include <stdexcept>

#include <fmt/format.h>

#include "gonio/apt_stage/apt_model.h"

namespace gonio::apt_stage {

void AptModel::validate() const {
  const auto require = [&](bool ok, const char* field, double value, const char* expected) {
    if (!ok) {
      throw std::invalid_argument(
          fmt::format("stage model {}: {}: found {}, expected {}", name, field, value, expected));
    }
  };
  const auto positive = [&](const char* field, double value) {
    require(value > 0.0 && std::isfinite(value), field, value, "above 0");
  };
  if (name.empty()) throw std::invalid_argument("stage model: name: found none, expected a name");
  positive("steps_per_deg", steps_per_deg);
  positive("velocity_per_deg_s", velocity_per_deg_s);
  positive("acceleration_per_deg_s2", acceleration_per_deg_s2);
  positive("max_speed_deg_per_s", max_speed_deg_per_s);
  positive("max_acceleration_deg_per_s2", max_acceleration_deg_per_s2);
  positive("home_speed_deg_per_s", home_speed_deg_per_s);
  positive("in_position_deg", in_position_deg);
  require(std::isfinite(home_offset_deg), "home_offset_deg", home_offset_deg, "a finite angle");
  require(home_switch_deg >= 0.0 && std::isfinite(home_switch_deg), "home_switch_deg",
          home_switch_deg, "0 or more");
}

AptModel k10cr1() {
  AptModel model;
  model.name = "K10CR1";
  model.steps_per_deg = 409600.0 / 3.0;
  model.velocity_per_deg_s = 7329109.0;
  model.acceleration_per_deg_s2 = 1502.0;
  model.max_speed_deg_per_s = 10.0;
  model.max_acceleration_deg_per_s2 = 20.0;
  model.home_speed_deg_per_s = 10.0;
  return model;
}

}  // namespace gonio::apt_stage
