#pragma once

#include <cstdint>
#include <string>

#include "gonio/apt_stage/apt_messages.h"

namespace gonio::apt_stage {

/// Which way the joint angle goes while the axis searches its home mark.
enum class HomeDirection { falling, rising };

/// What one kind of stage counts in, as data.
struct AptModel {
  std::string name;                 ///< as its hardware information says, "K10CR1"
  double steps_per_deg = 1.0;       ///< microsteps
  double velocity_per_deg_s = 1.0;  ///< units of VelocityParams::maximum
  double acceleration_per_deg_s2 = 1.0;
  double max_speed_deg_per_s = 1.0;
  double max_acceleration_deg_per_s2 = 1.0;
  double home_speed_deg_per_s = 1.0;  ///< at most; the axis's own speed if that is less
  double home_offset_deg = 0.0;       ///< from the switch to the stage's zero
  double in_position_deg = 0.01;      ///< how close to its target a move must end
  /// This close to zero a limit bit means the home switch, which a rotary stage has in its place.
  double home_switch_deg = 2.0;
  std::uint32_t alarm_bits =
      status::kOverload | status::kPositionError | status::kOverheat;  ///< each is a Fault

  /// Throws std::invalid_argument naming the field, what was found and what is expected.
  void validate() const;
};

/// Thorlabs K10CR1 rotation mount: 49,152,000 microsteps per turn; velocity 7329109 per deg/s and
/// acceleration 1502 per deg/s^2; at most 10 deg/s and 20 deg/s^2 (APT protocol issue 25, section
/// 8, K10CR1).
AptModel k10cr1();

/// The USB chip of every such stage: an FT232 with Thorlabs' own product id.
inline constexpr std::uint16_t kAptVendor = 0x0403;
inline constexpr std::uint16_t kAptProduct = 0xFAF0;

}  // namespace gonio::apt_stage
