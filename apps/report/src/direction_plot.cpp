#include <fmt/format.h>

#include <cmath>

#include "gonio/brdf/directions.h"
#include "page_parts.h"
#include "plots.h"

namespace gonio::report {
namespace {

constexpr double kSize = 360.0;
constexpr double kHemisphereRadius = 150.0;
constexpr Point kHemisphereCentre = {180.0, 180.0};

enum class Side { light, detector };

Eigen::Vector3d side_of(const brdf::HalfDiff& direction, Side side) {
  brdf::HalfDiff in_plane = direction;
  in_plane.phi_h = Angle();  // isotropic: the half vector is drawn towards the right
  const brdf::DirectionPair pair = brdf::directions_from_half_diff(in_plane);
  return side == Side::light ? pair.wi : pair.wo;
}

double polar_deg(const Eigen::Vector3d& w) {
  return Angle::from_radians(std::atan2(std::hypot(w.x(), w.y()), w.z())).degrees();
}

/// Equal steps of theta are equal steps outwards.
Point on_plot(const Eigen::Vector3d& w) {
  const double radius = polar_deg(w) / 90.0 * kHemisphereRadius;
  const double length = std::hypot(w.x(), w.y());
  if (length == 0.0) return kHemisphereCentre;
  return {kHemisphereCentre.x + radius * w.x() / length,
          kHemisphereCentre.y - radius * w.y() / length};
}

std::string angles_text(const brdf::HalfDiff& d) {
  return fmt::format("θh {:.2f}°, θd {:.2f}°, φd {:.2f}°", d.theta_h.degrees(), d.theta_d.degrees(),
                     d.phi_d.degrees());
}

void draw_hemisphere(Svg& svg) {
  svg.circle(kHemisphereCentre, kHemisphereRadius, "hemi");
  for (const double theta : {30.0, 60.0})
    svg.circle(kHemisphereCentre, theta / 90.0 * kHemisphereRadius, "ring");
  for (int i = 0; i < 8; ++i) {
    const double phi = i * 45.0 * 3.14159265358979 / 180.0;
    svg.line(kHemisphereCentre,
             {kHemisphereCentre.x + kHemisphereRadius * std::cos(phi),
              kHemisphereCentre.y - kHemisphereRadius * std::sin(phi)},
             "ring");
  }
  for (const double theta : {30.0, 60.0, 90.0}) {
    svg.text(
        {kHemisphereCentre.x + 4.0, kHemisphereCentre.y + theta / 90.0 * kHemisphereRadius - 4.0},
        "start", "tick", fmt::format("{:.0f}°", theta));
  }
}

std::string hemisphere(const ReportData& data, Side side) {
  const bool light = side == Side::light;
  const std::string_view css = light ? "light" : "detector";
  Svg svg(kSize, kSize, light ? "directions of the light" : "directions of the detector");
  draw_hemisphere(svg);
  for (const FittedSample& s : data.samples) {
    svg.circle(on_plot(side_of(s.sample.direction, side)), 2.0, fmt::format("sub {}", css));
  }
  for (const RefusedDirection& r : data.refused) {
    const Eigen::Vector3d w = side_of(r.direction, side);
    if (polar_deg(w) > 96.0) continue;  // far below the horizon: off the drawing, listed below
    const Point p = on_plot(w);
    svg.line({p.x - 5, p.y - 5}, {p.x + 5, p.y + 5}, "refused");
    svg.line({p.x - 5, p.y + 5}, {p.x + 5, p.y - 5}, "refused");
  }
  for (const MeasuredPose& pose : data.poses) {
    const Eigen::Vector3d w = side_of(pose.direction, side);
    const Point p = on_plot(w);
    svg.circle(p, 8.5, fmt::format("pose {}", css),
               fmt::format("point {} ({}), θ{} {:.1f}°: {}", pose.pose, pose.branch,
                           light ? "i" : "o", polar_deg(w), angles_text(pose.direction)));
    svg.text({p.x, p.y + 3.6}, "middle", "poseno", fmt::format("{}", pose.pose));
  }
  return svg.finish();
}

std::string half_difference_plane(const ReportData& data) {
  Svg svg(kSize, kSize, "theta_h and theta_d of the directions");
  const Axis x = Axis::linear(0.0, 9.0, 44.0, 344.0);  // sqrt(theta_h): equal steps are cells
  const Axis y = Axis::linear(0.0, 90.0, 322.0, 22.0);
  const auto sqrt_deg = [](Angle a) { return std::sqrt(std::max(0.0, a.degrees()) * 0.9); };
  svg.rect({44.0, 22.0}, 300.0, 300.0, "frame");
  for (const double theta_h : {1.0, 5.0, 15.0, 30.0, 60.0, 90.0}) {
    const double at = x(std::sqrt(theta_h * 0.9));
    svg.line({at, 22.0}, {at, 322.0}, "ring");
    svg.text({at, 337.0}, "middle", "tick", fmt::format("{:.0f}°", theta_h));
  }
  for (const double theta_d : {0.0, 30.0, 60.0, 90.0}) {
    svg.line({44.0, y(theta_d)}, {344.0, y(theta_d)}, "ring");
    svg.text({38.0, y(theta_d) + 4.0}, "end", "tick", fmt::format("{:.0f}°", theta_d));
  }
  svg.text({194.0, 354.0}, "middle", "axis", "half angle θh (square-root spaced)");
  svg.upward_text({11.0, 172.0}, "axis", "difference angle θd");
  const auto place = [&](const brdf::HalfDiff& d) {
    return Point{x(sqrt_deg(d.theta_h)), y(d.theta_d.degrees())};
  };
  for (const FittedSample& s : data.samples) svg.circle(place(s.sample.direction), 2.0, "sub both");
  for (const RefusedDirection& r : data.refused) {
    const Point p = place(r.direction);
    svg.line({p.x - 5, p.y - 5}, {p.x + 5, p.y + 5}, "refused");
    svg.line({p.x - 5, p.y + 5}, {p.x + 5, p.y - 5}, "refused");
  }
  for (const MeasuredPose& pose : data.poses) {
    const Point p = place(pose.direction);
    svg.circle(p, 8.5, "pose both",
               fmt::format("point {}: {}", pose.pose, angles_text(pose.direction)));
    svg.text({p.x, p.y + 3.6}, "middle", "poseno", fmt::format("{}", pose.pose));
  }
  return svg.finish();
}

}  // namespace

std::string direction_figures(const ReportData& data) {
  if (data.samples.empty() && data.poses.empty()) return {};
  return fmt::format(
      "<div class=\"trio\">\n<figure>{}<figcaption>Light ω<sub>i</sub>, seen from above"
      "</figcaption></figure>\n<figure>{}<figcaption>Detector ω<sub>o</sub>, seen from above"
      "</figcaption></figure>\n<figure>{}<figcaption>Half and difference angles</figcaption>"
      "</figure>\n</div>\n",
      hemisphere(data, Side::light), hemisphere(data, Side::detector), half_difference_plane(data));
}

}  // namespace gonio::report
