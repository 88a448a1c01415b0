// What else is found with the whole rig follows its errors: one_sigma_rigs() of the stage and lamp,
// and of the zeros.

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <cmath>

#include "gonio/calibration/geometry/lamp_arm.h"
#include "gonio/calibration/geometry/zero_offsets.h"
#include "mirror_views.h"

namespace gonio::calibration::geometry {
namespace {

using test::HiddenRig;
using test::joints_deg;

/// Where a place on the sample comes to lie in the picture.
Eigen::Vector2d pixel_of(const CalibratedRig& with, const rig::Joints& joints) {
  const rig::RigPose pose = rig::forward(with.rig, joints);
  const Eigen::Vector3d place(20.0, -15.0, 0.0);
  return with.camera.project(pose.world_from_camera.inverse() * (pose.world_from_sample * place));
}

class OneSigmaRigs : public ::testing::Test {
 protected:
  OneSigmaRigs()
      : hidden_(test::hidden_rig(8, test::Scale::Full)),
        stage_(test::found_stage(hidden_, 8)),
        lamp_(fit_lamp_arm(
            stage_,
            test::mirror_views(hidden_, test::hidden_mirror(8, test::usual_mount()), 8, true),
            test::usual_mount(), test::with_jitter())),
        found_{stage_.rig, stage_.camera} {
    found_.rig.lamp = lamp_.rig.lamp;
  }

  HiddenRig hidden_;
  StageAxes stage_;
  LampArm lamp_;
  CalibratedRig found_;
};

TEST_F(OneSigmaRigs, MoveTheLampAsItsCovarianceSays) {
  const auto wi = [](const rig::RigDescription& rig) {
    return Eigen::Vector3d(
        rig::forward(rig, joints_deg(90.0, 0.0, 0.0)).world_from_lamp.translation().normalized());
  };
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  for (const CalibratedRig& other : one_sigma_rigs(stage_, lamp_)) {
    const Eigen::Vector3d moved = wi(other.rig) - wi(found_.rig);
    sum += moved * moved.transpose();
  }
  const Eigen::Matrix3d stated = lamp_direction(lamp_, Angle::from_degrees(90.0)).covariance;
  EXPECT_NEAR(sum.trace() / stated.trace(), 1.0, 0.01);
}

TEST_F(OneSigmaRigs, CarryTheLensThatGoesWithThem) {
  // Focal length and distance are each known to a few parts in ten thousand, a place in the picture
  // far better: it is what was looked at.
  double together = 0.0;
  double rig_alone = 0.0;
  const rig::Joints pose = joints_deg(60.0, 30.0, 10.0);
  const Eigen::Vector2d middle = pixel_of(found_, pose);
  for (const CalibratedRig& other : one_sigma_rigs(stage_, lamp_)) {
    together += (pixel_of(other, pose) - middle).squaredNorm();
    rig_alone += (pixel_of({other.rig, found_.camera}, pose) - middle).squaredNorm();
  }
  EXPECT_LT(std::sqrt(together), 0.15);
  EXPECT_GT(std::sqrt(rig_alone), 3.0 * std::sqrt(together));
}

}  // namespace
}  // namespace gonio::calibration::geometry
