#include "forward_model.h"

#include <cmath>

namespace gonio::calibration {

double predicted_signal(const instrument::Instrument& instrument, const VerificationData& data,
                        const WhiteView& view, const PixelSignal& pixel) {
  const auto factor = white_factor(instrument, view, pixel);
  if (!factor) return 0.0;
  return data.constant[static_cast<std::size_t>(view.channel)] * factor->per_constant;
}

Eigen::Vector2d lamp_error(const instrument::Instrument& instrument, const HighlightView& view) {
  const rig::RigPose pose = rig::forward(instrument.rig, view.joints);
  const Eigen::Isometry3d sample_from_world = pose.world_from_sample.inverse();
  const Eigen::Isometry3d sample_from_camera = sample_from_world * pose.world_from_camera;
  const Eigen::Vector3d eye = sample_from_camera.translation();
  const Eigen::Vector3d ray =
      sample_from_camera.linear() * instrument.camera.ray(view.pixel.x(), view.pixel.y());
  if (!(ray.z() < 0.0) || !(eye.z() > 0.0)) return Eigen::Vector2d::Constant(1.0);
  const Eigen::Vector3d point = eye - ray * (eye.z() / ray.z());
  const Eigen::Vector3d mirrored(ray.x(), ray.y(), -ray.z());
  const Eigen::Vector3d lamp =
      (sample_from_world * pose.world_from_lamp.translation() - point).normalized();
  const Eigen::Vector3d across = lamp.unitOrthogonal();
  const Eigen::Vector3d error = mirrored.cross(lamp);
  Eigen::Vector2d angles(error.dot(across), error.dot(lamp.cross(across)));
  if (mirrored.dot(lamp) < 0.0) angles = angles.normalized() * (2.0 - angles.norm());
  return angles;
}

}  // namespace gonio::calibration
