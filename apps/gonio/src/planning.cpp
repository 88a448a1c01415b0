#include "planning.h"

#include <fmt/format.h>

#include <algorithm>
#include <numbers>

namespace gonio::cli {
namespace {

using Seconds = std::chrono::duration<double>;

/// A bracket takes a shortest exposure, one or two others, and the readouts; a still longer one for
/// the dimmest spot is the exception.
double bracket_seconds(const RigFile& rig, double shortest_s) {
  return shortest_s * (1.0 + rig.session.bracket_ratio) +
         3.0 * Seconds(rig.world.camera.readout).count();
}

/// What the first exposure is set for: a white under normal incidence, in 1/sr.
double white_radiance(const RigFile& rig) {
  return rig.white.reflectance.mean() / std::numbers::pi;
}

double first_exposure_us(const RigFile& rig) {
  return static_cast<double>(rig.session.first_exposure.count()) / 1e3;
}

double channel_count(const RigFile& rig) { return rig.white_light ? 1.0 : 3.0; }

}  // namespace

/// The lamp-off frame at the end repeats the longest exposure.
double point_seconds(const RigFile& rig, double shortest_s) {
  return channel_count(rig) * bracket_seconds(rig, shortest_s) +
         shortest_s * rig.session.bracket_ratio + Seconds(rig.world.camera.readout).count();
}

double overhead_seconds(const RigFile& rig) {
  const double frame = Seconds(rig.session.first_exposure + rig.world.camera.readout).count();
  const bool changed = rig.session.white != acquisition::WhitePlacement::in_frame;
  const double white =
      channel_count(rig) * (bracket_seconds(rig, Seconds(rig.session.first_exposure).count()) +
                            rig.session.white_frames * frame) +
      (changed ? 2.0 * Seconds(rig.world.change_time).count() : 0.0);
  double homing = 0.0;
  for (const rig::Axis& axis : rig.rig.axes) {
    homing = std::max(homing, (axis.max - axis.min).degrees() / axis.max_speed_deg_per_s);
  }
  return 2.0 * white + homing;
}

acquisition::MeasurementPlan plan_poses(const RigFile& rig, const rig::Inverse& inverse,
                                        const std::vector<samples::Direction>& directions,
                                        std::uint64_t seed) {
  return acquisition::make_plan(inverse, directions,
                                point_seconds(rig, Seconds(rig.session.first_exposure).count()),
                                overhead_seconds(rig), seed);
}

std::string to_text(const brdf::HalfDiff& direction) {
  return fmt::format("({:.2f}, {:.2f}, {:.2f}) deg", direction.theta_h.degrees(),
                     direction.theta_d.degrees(), direction.phi_d.degrees());
}

double expected_exposure_us(const RigFile& rig, const basis::BasisRows& rows,
                            const brdf::HalfDiff& direction) {
  const basis::BasisRow row = rows.at(direction);
  const double brdf = rows.basis().mapping.inverse(row.mean, row.weight);
  const double cos_theta_i =
      brdf::polar_cosines(direction.theta_h, direction.theta_d, direction.phi_d).cos_theta_i;
  const double relative = std::max(brdf * cos_theta_i / white_radiance(rig), 1e-6);
  return std::clamp(std::round(first_exposure_us(rig) / relative),
                    static_cast<double>(rig.world.camera.min_exposure.count()) / 1e3,
                    static_cast<double>(rig.session.max_exposure.count()) / 1e3);
}

double radiance_of_exposure(const RigFile& rig, double exposure_us) {
  return white_radiance(rig) * first_exposure_us(rig) / exposure_us;
}

}  // namespace gonio::cli
