// Black glass against Fresnel, on a rig whose axes are off.

#include "gonio/calibration/radiometry/glass_ratios.h"

#include <gmock/gmock.h>

#include <Eigen/Geometry>
#include <cmath>
#include <string>
#include <vector>

#include "gonio/calibration/result/step_refused.h"
#include "white_scene.h"

namespace gonio::calibration {
namespace {

constexpr double kIndex = 1.52;

/// Both polarisations by the law of refraction: Hecht, Optics, eq. 4.42 and 4.43 as sines and
/// tangents of the angles on both sides.
double reflectance(double incidence) {
  const double refracted = std::asin(std::sin(incidence) / kIndex);
  const double s = std::sin(incidence - refracted) / std::sin(incidence + refracted);
  const double p = std::tan(incidence - refracted) / std::tan(incidence + refracted);
  return 0.5 * (s * s + p * p);
}

/// A rig whose lamp arm and azimuth count from elsewhere, as calibration found.
instrument::Instrument rig_with_zeros() {
  instrument::Instrument truth = true_instrument();
  for (rig::Chain* chain : {&truth.rig.lamp, &truth.rig.sample}) {
    for (rig::ChainLink& link : chain->links) {
      if (link.axis < 2) link.offset += Angle::from_degrees(link.axis == 0 ? 0.5 : -0.5);
    }
  }
  return truth;
}

/// The lamp's image in glass that lies flat: mirrored behind the plane, dimmer by the square of the
/// whole way, by lamp field and lens.
GlassView seen_glass(const instrument::Instrument& truth, double arm_deg) {
  GlassView view{joints_deg(arm_deg, 0.5 * arm_deg, 0.0)};
  const rig::RigPose pose = rig::forward(truth.rig, view.joints);
  const Eigen::Vector3d normal = pose.world_from_sample.linear().col(2);
  const Eigen::Vector3d lamp = pose.world_from_lamp.translation();
  const Eigen::Vector3d eye = pose.world_from_camera.translation();
  const Eigen::Vector3d image =
      lamp - 2.0 * normal * normal.dot(lamp - pose.world_from_sample.translation());
  view.pixel = truth.camera.project(pose.world_from_camera.inverse() * image);
  const Eigen::Vector3d along = (image - eye).normalized();
  const Eigen::Vector3d point =
      eye + along * (normal.dot(pose.world_from_sample.translation() - eye) / normal.dot(along));
  const Eigen::Vector3d beam = pose.world_from_lamp.linear().transpose() * (point - lamp);
  const double x = beam.x() / beam.z();
  const double y = beam.y() / beam.z();
  const auto& c = truth.lamp_field;
  const double field = 1.0 + c.c10 * x + c.c01 * y + c.c20 * x * x + c.c11 * x * y + c.c02 * y * y;
  const double q = (std::pow(view.pixel.x() - truth.camera.cx_px, 2) +
                    std::pow(view.pixel.y() - truth.camera.cy_px, 2)) /
                   std::pow(truth.camera.fx_px, 2);
  const double lens = 1.0 + truth.vignetting.v1 * q + truth.vignetting.v2 * q * q;
  view.light =
      1e9 * field * lens * reflectance(std::acos(-normal.dot(along))) / (image - eye).squaredNorm();
  return view;
}

std::vector<GlassView> seen_at(const instrument::Instrument& truth,
                               const std::vector<double>& arms_deg) {
  std::vector<GlassView> views;
  for (const double arm_deg : arms_deg) views.push_back(seen_glass(truth, arm_deg));
  return views;
}

TEST(GlassRatios, AreOneWhereTheCalibratedRigHasTheLampWhateverTheCommandedAngles) {
  const auto truth = rig_with_zeros();
  const auto ratios = glass_ratios(truth, seen_at(truth, {60.0, 113.4, 140.0}), kIndex);
  ASSERT_EQ(ratios.size(), 2U);
  constexpr double kRounding = 1e-6;
  for (const RatioCheck& ratio : ratios) {
    EXPECT_NEAR(ratio.found / ratio.expected, 1.0, kRounding) << ratio.name;
  }
  // Half of what the arm is off by; the mirrored ray meets the glass beside its middle, where the
  // nearer camera stands further from its normal.
  EXPECT_THAT(ratios[1].name, testing::HasSubstr("at 70.4 deg over 30.4 deg"));
}

TEST(GlassRatios, ShowAnotherGlassAndALampThatIsElsewhere) {
  const auto truth = rig_with_zeros();
  const auto views = seen_at(truth, {60.0, 140.0});
  EXPECT_GT(std::abs(glass_ratios(truth, views, 1.8)[0].found - 1.0), 0.05);
  // Half a degree of the arm is a quarter of a degree of incidence: 2 % at 70 deg, and why its
  // command will not do.
  EXPECT_GT(std::abs(glass_ratios(true_instrument(), views, kIndex)[0].found - 1.0), 0.01);
}

TEST(GlassRatios, RefuseWhatIsNoImage) {
  const auto truth = true_instrument();
  auto views = seen_at(truth, {60.0, 140.0});
  EXPECT_THAT([&] { glass_ratios(truth, {views[0]}, kIndex); },
              testing::ThrowsMessage<StepRefused>(testing::HasSubstr("found 1 poses")));
  views[1].light = 0.0;
  EXPECT_THAT([&] { glass_ratios(truth, views, kIndex); },
              testing::ThrowsMessage<StepRefused>(testing::HasSubstr("black glass")));
}

}  // namespace
}  // namespace gonio::calibration
