#pragma once

#include <cmath>
#include <compare>
#include <numbers>

namespace gonio {

/// A plane angle. The only type in which an angle crosses a function boundary: degrees exist only
/// in files, logs and on the command line, radians only inside the maths.
///
/// Range    Any finite value; nothing is wrapped unless asked for.
/// Threads  Plain value.
class Angle {
 public:
  constexpr Angle() = default;

  static constexpr Angle from_radians(double radians) { return Angle(radians); }
  static constexpr Angle from_degrees(double degrees) { return Angle(degrees * kRadiansPerDegree); }

  constexpr double radians() const { return radians_; }
  constexpr double degrees() const { return radians_ / kRadiansPerDegree; }

  constexpr Angle operator-() const { return Angle(-radians_); }
  constexpr Angle operator+(Angle other) const { return Angle(radians_ + other.radians_); }
  constexpr Angle operator-(Angle other) const { return Angle(radians_ - other.radians_); }
  constexpr Angle operator*(double factor) const { return Angle(radians_ * factor); }
  constexpr Angle operator/(double divisor) const { return Angle(radians_ / divisor); }
  constexpr double operator/(Angle other) const { return radians_ / other.radians_; }
  constexpr Angle& operator+=(Angle other) { return *this = *this + other; }
  constexpr Angle& operator-=(Angle other) { return *this = *this - other; }
  friend constexpr Angle operator*(double factor, Angle angle) { return angle * factor; }

  constexpr auto operator<=>(const Angle&) const = default;

 private:
  static constexpr double kRadiansPerDegree = std::numbers::pi / 180.0;
  explicit constexpr Angle(double radians) : radians_(radians) {}

  double radians_ = 0.0;
};

inline double sin(Angle angle) { return std::sin(angle.radians()); }
inline double cos(Angle angle) { return std::cos(angle.radians()); }
inline double tan(Angle angle) { return std::tan(angle.radians()); }
constexpr Angle abs(Angle angle) { return angle < Angle() ? -angle : angle; }

/// The same direction in (-180, 180] degrees.
inline Angle wrap_to_half_turn(Angle angle) {
  const double wrapped = std::remainder(angle.radians(), 2.0 * std::numbers::pi);
  return Angle::from_radians(wrapped <= -std::numbers::pi ? std::numbers::pi : wrapped);
}

namespace literals {
constexpr Angle operator""_deg(long double degrees) {
  return Angle::from_degrees(static_cast<double>(degrees));
}
constexpr Angle operator""_deg(unsigned long long degrees) {
  return Angle::from_degrees(static_cast<double>(degrees));
}
}  // namespace literals

}  // namespace gonio
