#include "gonio/calibration/radiometry/glass_ratios.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <cmath>

#include "gonio/brdf/fresnel.h"
#include "gonio/calibration/result/step_refused.h"
#include "gonio/instrument/measurement_equation.h"

namespace gonio::calibration {
namespace {

constexpr double kGlassLimit = 0.05;
constexpr std::size_t kFewestViews = 2;

struct GlassReading {
  Angle incidence;
  double over_fresnel = 0.0;  ///< in a unit of its own
};

GlassReading reading_of(const instrument::Instrument& instrument, const GlassView& view,
                        double index) {
  const rig::RigPose pose = rig::forward(instrument.rig, view.joints);
  const auto seen = instrument::pixel_geometry(instrument, pose, view.pixel.x(), view.pixel.y());
  if (!seen || !(view.light > 0.0)) {
    throw StepRefused(fmt::format(
        "black glass: found an image of {:.3g} DN/s at pixel ({:.1f}, {:.1f}), expected light on "
        "the front of the sample plane: is the glass in the holder?",
        view.light, view.pixel.x(), view.pixel.y()));
  }
  const auto& [wi, wo] = seen->directions;
  const double incidence = 0.5 * std::atan2(wi.cross(wo).norm(), wi.dot(wo));
  const Eigen::Vector3d point = pose.world_from_sample * seen->point_in_sample_mm;
  const Eigen::Vector3d from_lamp = point - pose.world_from_lamp.translation();
  const double way_mm = (pose.world_from_camera.translation() - point).norm() +
                        (pose.collimated_lamp ? 0.0 : from_lamp.norm());
  const Eigen::Vector3d in_lamp = pose.world_from_lamp.linear().transpose() * from_lamp;
  const double field =
      pose.collimated_lamp ? 1.0 : instrument::relative_intensity(instrument.lamp_field, in_lamp);
  const double lens = instrument::relative_response(instrument, view.pixel.x(), view.pixel.y());
  const double fresnel = brdf::fresnel_reflectance(std::cos(incidence), index, 0.0);
  return {Angle::from_radians(incidence), view.light * way_mm * way_mm / (field * lens * fresnel)};
}

}  // namespace

std::vector<RatioCheck> glass_ratios(const instrument::Instrument& instrument,
                                     const std::vector<GlassView>& views, double index) {
  if (views.size() < kFewestViews) {
    throw StepRefused(fmt::format("black glass: found {} poses, expected at least {}", views.size(),
                                  kFewestViews));
  }
  const GlassReading first = reading_of(instrument, views.front(), index);
  std::vector<RatioCheck> ratios;
  for (auto view = views.begin() + 1; view != views.end(); ++view) {
    const GlassReading here = reading_of(instrument, *view, index);
    ratios.push_back({fmt::format("black glass at {:.1f} deg over {:.1f} deg, Fresnel",
                                  here.incidence.degrees(), first.incidence.degrees()),
                      here.over_fresnel / first.over_fresnel, 1.0, kGlassLimit});
  }
  return ratios;
}

}  // namespace gonio::calibration
