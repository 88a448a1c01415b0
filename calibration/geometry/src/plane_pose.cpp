#include "plane_pose.h"

#include <Eigen/SVD>
#include <cmath>
#include <limits>

#include "gonio/errors/errors.h"

namespace gonio::calibration::geometry {
namespace {

/// Moves points about their mean to a mean distance of sqrt(2): keeps the equations well scaled.
Eigen::Matrix3d conditioner(const Eigen::Matrix2Xd& points) {
  const Eigen::Vector2d mean = points.rowwise().mean();
  const double spread = (points.colwise() - mean).colwise().norm().mean();
  if (!(spread > 0.0)) throw NumericalError("the corners of a view lie on one point");
  const double scale = std::sqrt(2.0) / spread;
  Eigen::Matrix3d result;
  result << scale, 0.0, -scale * mean.x(), 0.0, scale, -scale * mean.y(), 0.0, 0.0, 1.0;
  return result;
}

}  // namespace

Eigen::Matrix3d homography_of(const BoardView& view, const instrument::CameraModel& camera) {
  const auto count = static_cast<Eigen::Index>(view.corners.size());
  Eigen::Matrix2Xd from(2, count);
  Eigen::Matrix2Xd to(2, count);
  for (Eigen::Index k = 0; k < count; ++k) {
    const BoardCorner& corner = view.corners[static_cast<std::size_t>(k)];
    from.col(k) = corner.point_mm;
    to.col(k) = camera.ray(corner.pixel.x(), corner.pixel.y()).hnormalized();
  }
  const Eigen::Matrix3d condition_from = conditioner(from);
  const Eigen::Matrix3d condition_to = conditioner(to);
  Eigen::MatrixXd equations(2 * count, 9);
  for (Eigen::Index k = 0; k < count; ++k) {
    const Eigen::Vector3d a = condition_from * from.col(k).homogeneous();
    const Eigen::Vector3d b = condition_to * to.col(k).homogeneous();
    equations.row(2 * k) << a.transpose(), Eigen::RowVector3d::Zero(), -b.x() * a.transpose();
    equations.row(2 * k + 1) << Eigen::RowVector3d::Zero(), a.transpose(), -b.y() * a.transpose();
  }
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(equations, Eigen::ComputeFullV);
  constexpr double kOneLine = 1e-6;  // second smallest singular value: corners on one line
  if (svd.singularValues()[7] < kOneLine * svd.singularValues()[0]) {
    throw NumericalError("the corners of a view lie on one line");
  }
  const Eigen::VectorXd h = svd.matrixV().col(8);
  Eigen::Matrix3d homography;
  homography << h.segment<3>(0).transpose(), h.segment<3>(3).transpose(),
      h.segment<3>(6).transpose();
  return condition_to.inverse() * homography * condition_from;
}

Eigen::Isometry3d camera_from_board_of(const Eigen::Matrix3d& homography) {
  const double scale = 0.5 * (homography.col(0).norm() + homography.col(1).norm());
  // The board is in front of the camera.
  const Eigen::Matrix3d h = homography / (homography(2, 2) < 0.0 ? -scale : scale);
  Eigen::Matrix3d axes;
  axes << h.col(0), h.col(1), h.col(0).cross(h.col(1));
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.linear() = nearest_rotation(axes);
  pose.translation() = h.col(2);
  return pose;
}

Eigen::Matrix3d rotation_by(const Eigen::Vector3d& vector) {
  const double angle = vector.norm();
  if (angle == 0.0) return Eigen::Matrix3d::Identity();
  return Eigen::AngleAxisd(angle, vector / angle).toRotationMatrix();
}

Eigen::Vector3d rotation_vector_of(const Eigen::Matrix3d& rotation) {
  const Eigen::AngleAxisd turn(rotation);
  return turn.angle() * turn.axis();
}

Eigen::Matrix3d nearest_rotation(const Eigen::Matrix3d& matrix) {
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(matrix, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Matrix3d u = svd.matrixU();
  if ((u * svd.matrixV().transpose()).determinant() < 0.0) u.col(2) *= -1.0;
  return u * svd.matrixV().transpose();
}

void pixel_residuals(const BoardView& view, const instrument::CameraModel& camera,
                     const Eigen::Isometry3d& camera_from_board,
                     Eigen::Ref<Eigen::VectorXd> residual) {
  Eigen::Index row = 0;
  for (const BoardCorner& corner : view.corners) {
    const Eigen::Vector3d point =
        camera_from_board * Eigen::Vector3d(corner.point_mm.x(), corner.point_mm.y(), 0.0);
    if (!(point.z() > 0.0)) {
      residual.setConstant(std::numeric_limits<double>::quiet_NaN());
      return;
    }
    residual.segment<2>(row) = corner.pixel - camera.project(point);
    row += 2;
  }
}

instrument::CameraModel changed_camera(const instrument::CameraModel& camera,
                                       const Eigen::VectorXd& change) {
  instrument::CameraModel result = camera;
  result.fx_px += change[0];
  result.fy_px += change[1];
  result.cx_px += change[2];
  result.cy_px += change[3];
  result.k1 += change[4];
  result.k2 += change[5];
  result.p1 += change[6];
  result.p2 += change[7];
  return result;
}

Eigen::VectorXd camera_steps() {
  Eigen::VectorXd steps(8);
  steps << 1.0, 1.0, 1.0, 1.0, 1e-2, 1e-1, 1e-3, 1e-3;
  return steps;
}

}  // namespace gonio::calibration::geometry
