#include "white_pose.h"

#include <algorithm>
#include <cmath>

#include "gonio/acquisition/itinerary.h"
#include "gonio/instrument/measurement_equation.h"

namespace gonio::acquisition {

bool white_in_view(const instrument::Instrument& instrument, const SessionOptions& options,
                   const rig::Joints& joints) {
  const rig::RigPose pose = rig::forward(instrument.rig, joints);
  const bool patch = options.white == WhitePlacement::in_frame;
  const Eigen::Vector2d centre = patch ? options.white_patch_mm : Eigen::Vector2d::Zero();
  const double half_mm = patch ? options.white_patch_half_width_mm
                               : options.white_half_width_mm.value_or(options.sample_half_width_mm);
  const std::vector<std::uint8_t> bad = instrument::bad_pixel_mask(
      instrument.sensor, instrument.camera.width_px, instrument.camera.height_px);
  // A pixel near one of these places is found at once; only a white at the very rim of the frame
  // has to be looked for pixel by pixel.
  constexpr int kPlaces = 5;
  for (int place = 0; place < kPlaces * kPlaces; ++place) {
    const Eigen::Vector2d share(place % kPlaces - kPlaces / 2, place / kPlaces - kPlaces / 2);
    const Eigen::Vector2d at = centre + half_mm * share / (kPlaces / 2 + 1);
    const auto pixel = instrument::pixel_of_point(instrument, pose, {at.x(), at.y(), 0.0});
    if (!pixel) continue;
    const double column = std::round(pixel->x());
    const double row = std::round(pixel->y());
    if (!(column >= 0.0 && row >= 0.0 && column < instrument.camera.width_px &&
          row < instrument.camera.height_px)) {
      continue;
    }
    const auto index =
        static_cast<std::size_t>(row) * static_cast<std::size_t>(instrument.camera.width_px) +
        static_cast<std::size_t>(column);
    const auto geometry = instrument::pixel_geometry(instrument, pose, column, row);
    if (bad[index] == 0 && geometry &&
        ((geometry->point_in_sample_mm.head<2>() - centre) / half_mm).cwiseAbs().maxCoeff() < 1.0) {
      return true;
    }
  }
  return !white_regions(instrument, options, joints).empty();
}

Regions white_regions(const instrument::Instrument& instrument, const SessionOptions& options,
                      const rig::Joints& joints) {
  const rig::RigPose pose = rig::forward(instrument.rig, joints);
  if (options.white == WhitePlacement::in_frame) {
    return regions_of(instrument, pose, options.white_patch_mm, options.white_patch_half_width_mm,
                      1);
  }
  return regions_of(instrument, pose, Eigen::Vector2d::Zero(),
                    options.white_half_width_mm.value_or(options.sample_half_width_mm));
}

rig::Joints white_joints(const rig::RigDescription& rig) {
  const rig::Inverse inverse(rig);
  const rig::TravelModel travel(rig);
  const rig::Joints home = rig.home();
  // theta_i = 45 and theta_o = 0: theta_h = theta_d = 22.5, phi_d = 0. Rigs that cannot (a tilt
  // that does not reach, a lamp that may not come so near, a keep-out in the way) take the next.
  std::vector<brdf::HalfDiff> candidates;
  for (const double theta_d : {22.5, 20.0, 15.0, 10.0, 30.0, 40.0}) {
    for (const double theta_h : {22.5, 15.0, 7.5, 0.0, 30.0}) {
      candidates.push_back(
          {Angle::from_degrees(theta_h), Angle::from_degrees(theta_d), Angle(), Angle()});
    }
  }
  const Angle wanted = Angle::from_degrees(22.5);
  std::stable_sort(candidates.begin(), candidates.end(), [&](const auto& a, const auto& b) {
    const auto distance = [&](const brdf::HalfDiff& d) {
      return std::hypot((d.theta_h - wanted).radians(), (d.theta_d - wanted).radians());
    };
    return distance(a) < distance(b);
  });
  bool reached = false;
  for (const brdf::HalfDiff& direction : candidates) {
    for (const rig::PoseSolution& pose : inverse.solve(direction).poses) {
      reached = true;
      if (travel.route(home, pose.joints) && travel.route(pose.joints, home)) return pose.joints;
    }
  }
  if (reached) {
    throw PreflightError(
        "pre-run check: keep-outs bar the way from home to every pose for the white reference");
  }
  throw PreflightError(
      "pre-run check: the rig reaches no pose at which a white reference can be measured");
}

}  // namespace gonio::acquisition
