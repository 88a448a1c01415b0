#include "stage_start.h"

#include <fmt/format.h>

#include <Eigen/QR>
#include <algorithm>
#include <cmath>

#include "gonio/calibration/result/step_refused.h"
#include "plane_pose.h"

namespace gonio::calibration::geometry {
namespace {

/// What one used view says.
struct SeenPose {
  double azimuth = 0.0;  // joint readings, rad
  double tilt = 0.0;
  Eigen::Isometry3d camera_from_board;
};

constexpr double kSameJoint_rad = 0.01;  // the other axis turns the direction by as little
constexpr double kSmallTurn_rad = 0.1;   // below, noise of the poses spoils the direction
constexpr double kRateTolerance = 0.1;

/// One axis from all pairs of views in which the other stands still: turn per joint angle as a
/// vector along the axis. `relative(a, b)` is the rotation from b to a in the frame where the axis
/// stands still.
template <typename Joint, typename Other, typename Relative>
Eigen::Vector3d turn_per_joint(const std::string& name, const std::vector<SeenPose>& poses,
                               Joint joint, Other other, Relative relative) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  double weight = 0.0;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      const double by = joint(poses[i]) - joint(poses[j]);
      if (std::abs(other(poses[i]) - other(poses[j])) > kSameJoint_rad) continue;
      if (std::abs(by) < kSmallTurn_rad) continue;
      sum += by * rotation_vector_of(relative(poses[i], poses[j]));
      weight += by * by;
    }
  }
  if (weight == 0.0) {
    throw StepRefused(
        fmt::format("stage axes: no two views differ in {} alone by 6 deg or more: "
                    "take views on a grid of azimuth and tilt",
                    name));
  }
  return sum / weight;
}

/// Sign of the link's scale, from the turn found and the nominal direction in the same frame.
double sense_of(const std::string& name, const Eigen::Vector3d& turn,
                const Eigen::Vector3d& nominal_direction, double nominal_scale,
                std::vector<std::string>& notes) {
  const double rate = turn.norm() / std::abs(nominal_scale);
  if (std::abs(rate - 1.0) > kRateTolerance) {
    throw StepRefused(
        fmt::format("stage axes: {} turns by {:.2f} deg per degree of its reading, "
                    "expected {:.2f}: check its steps per turn, and that board and "
                    "readings belong together",
                    name, turn.norm(), std::abs(nominal_scale)));
  }
  const double cosine = turn.normalized().dot(nominal_direction);
  constexpr double kNearNominal = 0.96;  // 16 deg
  if (std::abs(cosine) < kNearNominal) {
    throw StepRefused(
        fmt::format("stage axes: {} stands {:.0f} deg from where the rig file has it, "
                    "expected 15 at most: check axis and camera in the rig file",
                    name, std::acos(std::abs(cosine)) * 57.29577951308232));
  }
  const double sense = cosine < 0.0 ? -1.0 : 1.0;
  if (sense * nominal_scale < 0.0) {
    notes.push_back(fmt::format("{} counts the other way round than the rig file says", name));
  }
  return sense;
}

void require_span(const std::string& name, double span, Angle expected) {
  if (span >= expected.radians()) return;
  throw StepRefused(
      fmt::format("stage axes: {} spans {:.1f} deg over the usable views, expected "
                  "{:.0f} at least: take views farther apart",
                  name, Angle::from_radians(span).degrees(), expected.degrees()));
}

template <typename Joint>
double span_of(const std::vector<SeenPose>& poses, Joint joint) {
  const auto [low, high] = std::minmax_element(
      poses.begin(), poses.end(),
      [&](const SeenPose& a, const SeenPose& b) { return joint(a) < joint(b); });
  return joint(*high) - joint(*low);
}

/// The axes as lines and the board at reading zero, camera frame.
struct InCamera {
  Eigen::Vector3d azimuth;  // unit, along world z
  Eigen::Vector3d tilt;     // unit, at azimuth zero
  Eigen::Vector3d azimuth_point;
  Eigen::Vector3d tilt_point;
  Eigen::Isometry3d board;
};

/// Points and the board's place from t = A (G t0 + (I - G) p2) + (I - A) p1, linear in t0, p2, p1.
void solve_points(const std::vector<SeenPose>& poses, double azimuth_scale, double tilt_scale,
                  InCamera& found) {
  const auto count = static_cast<Eigen::Index>(poses.size());
  Eigen::MatrixXd equations(3 * count, 9);
  Eigen::VectorXd right(3 * count);
  const Eigen::Matrix3d identity = Eigen::Matrix3d::Identity();
  for (Eigen::Index k = 0; k < count; ++k) {
    const SeenPose& pose = poses[static_cast<std::size_t>(k)];
    const Eigen::Matrix3d a = rotation_by(azimuth_scale * pose.azimuth * found.azimuth);
    const Eigen::Matrix3d g = rotation_by(tilt_scale * pose.tilt * found.tilt);
    equations.middleRows(3 * k, 3) << a * g, a * (identity - g), identity - a;
    right.segment<3>(3 * k) = pose.camera_from_board.translation();
  }
  // Points may slide along their axes: the shortest of the solutions.
  Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd> decomposition;
  decomposition.setThreshold(1e-6);
  const Eigen::VectorXd x = decomposition.compute(equations).solve(right);
  found.board.translation() = x.segment<3>(0);
  found.tilt_point = x.segment<3>(3);
  found.azimuth_point = x.segment<3>(6);
}

/// The point of line 1 nearest to line 2.
Eigen::Vector3d foot_on_first(const Eigen::Vector3d& point_1, const Eigen::Vector3d& direction_1,
                              const Eigen::Vector3d& point_2, const Eigen::Vector3d& direction_2) {
  const Eigen::Vector3d between = point_2 - point_1;
  const double c = direction_1.dot(direction_2);
  const double along = (between.dot(direction_1) - c * between.dot(direction_2)) / (1.0 - c * c);
  return point_1 + along * direction_1;
}

/// Offsets with which the normal `n` at reading zero comes from x: n = Rot(tilt, t) Rot(z, a) x.
void solve_offsets(const Eigen::Vector3d& n, const Eigen::Vector3d& tilt, double& azimuth_offset,
                   double& tilt_offset) {
  Eigen::Vector2d angle(std::atan2(n.y(), n.x()), 0.0);
  const auto miss = [&](const Eigen::Vector2d& at) {
    const Eigen::Vector3d x =
        Eigen::AngleAxisd(-at[0], Eigen::Vector3d::UnitZ()) * (Eigen::AngleAxisd(-at[1], tilt) * n);
    return Eigen::Vector2d(x.y(), x.z());
  };
  for (int iteration = 0; iteration < 20; ++iteration) {  // Newton; 5 are enough
    Eigen::Matrix2d jacobian;
    for (int k = 0; k < 2; ++k) {
      Eigen::Vector2d step = Eigen::Vector2d::Zero();
      step[k] = kAngleStep_rad;
      jacobian.col(k) = (miss(angle + step) - miss(angle - step)) / (2.0 * kAngleStep_rad);
    }
    angle -= jacobian.fullPivLu().solve(miss(angle));
  }
  azimuth_offset = angle[0];
  tilt_offset = angle[1];
}

StageGeometry geometry_from(const InCamera& found, const Eigen::Vector3d& normal_in_board) {
  Eigen::Isometry3d camera_from_world = Eigen::Isometry3d::Identity();
  const Eigen::Vector3d origin =
      foot_on_first(found.azimuth_point, found.azimuth, found.tilt_point, found.tilt);
  const Eigen::Vector3d z = found.azimuth;
  const Eigen::Vector3d x = (-origin + origin.dot(z) * z).normalized();
  camera_from_world.linear() << x, z.cross(x), z;
  camera_from_world.translation() = origin;

  StageGeometry geometry;
  geometry.world_from_camera = camera_from_world.inverse();
  const Eigen::Vector3d tilt_at_zero = geometry.world_from_camera.linear() * found.tilt;
  const Eigen::Vector3d tilt_point_at_zero = geometry.world_from_camera * found.tilt_point;
  const Eigen::Isometry3d board_at_zero = geometry.world_from_camera * found.board;
  solve_offsets(board_at_zero.linear() * normal_in_board, tilt_at_zero, geometry.azimuth_offset,
                geometry.tilt_offset);

  const Eigen::Isometry3d back =
      turn_about(Eigen::Vector3d::UnitZ(), Eigen::Vector3d::Zero(), -geometry.azimuth_offset);
  geometry.tilt_direction = (back.linear() * tilt_at_zero).normalized();
  const Eigen::Vector3d point = back * tilt_point_at_zero;
  geometry.skew_mm =
      point.dot(Eigen::Vector3d::UnitZ().cross(geometry.tilt_direction).normalized());
  const Eigen::Isometry3d untilt =
      turn_about(geometry.tilt_direction, point, -geometry.tilt_offset);
  geometry.world_from_board = untilt * back * board_at_zero;
  // The normal exactly along x, which noise in the start has not made it.
  geometry.world_from_board.linear() =
      rotation_between(geometry.world_from_board.linear() * normal_in_board,
                       Eigen::Vector3d::UnitX()) *
      geometry.world_from_board.linear();
  return geometry;
}

/// Which side of the board the camera sees.
Eigen::Vector3d outward_normal(const std::vector<SeenPose>& poses) {
  std::size_t facing = 0;
  for (const SeenPose& pose : poses) {
    const Eigen::Vector3d z = pose.camera_from_board.linear().col(2);
    if (z.dot(pose.camera_from_board.translation()) < 0.0) ++facing;
  }
  if (facing != 0 && facing != poses.size()) {
    throw StepRefused(
        fmt::format("stage axes: {} of {} views show the board from behind, expected "
                    "one side: detect the corners again",
                    std::min(facing, poses.size() - facing), poses.size()));
  }
  return facing == 0 ? Eigen::Vector3d(-Eigen::Vector3d::UnitZ())
                     : Eigen::Vector3d(Eigen::Vector3d::UnitZ());
}

}  // namespace

StageGeometry start_of_stage(const rig::RigDescription& nominal,
                             const instrument::CameraModel& camera,
                             std::span<const StageView> views,
                             const std::vector<FittedView>& fitted, const StageAxesOptions& options,
                             std::vector<std::string>& notes) {
  const rig::ChainLink& azimuth_link = nominal.sample.links[0];
  const rig::ChainLink& tilt_link = nominal.sample.links[1];
  std::vector<SeenPose> poses;
  for (std::size_t v = 0; v < views.size(); ++v) {
    if (!fitted[v].used) continue;
    poses.push_back({views[v].joints[azimuth_link.axis].radians(),
                     views[v].joints[tilt_link.axis].radians(), fitted[v].camera_from_board});
  }
  const auto azimuth = [](const SeenPose& pose) { return pose.azimuth; };
  const auto tilt = [](const SeenPose& pose) { return pose.tilt; };
  require_span("azimuth", span_of(poses, azimuth), options.min_azimuth_span);
  require_span("tilt", span_of(poses, tilt), options.min_tilt_span);

  // The azimuth axis stands still before the camera, the tilt axis on the board.
  InCamera found;
  const auto in_camera = [](const SeenPose& a, const SeenPose& b) {
    return Eigen::Matrix3d(a.camera_from_board.linear() * b.camera_from_board.linear().transpose());
  };
  const Eigen::Vector3d azimuth_turn = turn_per_joint("azimuth", poses, azimuth, tilt, in_camera);
  const Eigen::Matrix3d camera_from_world = nominal.camera.home_pose.linear().transpose();
  const double azimuth_sense =
      sense_of("azimuth", azimuth_turn, camera_from_world * azimuth_link.direction,
               azimuth_link.scale, notes);
  const double up = azimuth_link.direction.z() < 0.0 ? -1.0 : 1.0;
  const double azimuth_scale = up * azimuth_sense * std::abs(azimuth_link.scale);
  found.azimuth = up * azimuth_sense * azimuth_turn.normalized();

  const auto on_board = [](const SeenPose& a, const SeenPose& b) {
    return Eigen::Matrix3d(b.camera_from_board.linear().transpose() * a.camera_from_board.linear());
  };
  const Eigen::Vector3d tilt_turn = turn_per_joint("tilt", poses, tilt, azimuth, on_board);
  Eigen::Vector3d tilt_turn_in_camera = Eigen::Vector3d::Zero();  // at azimuth zero
  for (const SeenPose& pose : poses) {
    tilt_turn_in_camera += rotation_by(-azimuth_scale * pose.azimuth * found.azimuth) *
                           pose.camera_from_board.linear() * tilt_turn;
  }
  tilt_turn_in_camera *= tilt_turn.norm() / tilt_turn_in_camera.norm();
  const Eigen::Vector3d nominal_tilt =
      Eigen::AngleAxisd(azimuth_link.offset.radians(), azimuth_link.direction) *
      tilt_link.direction;
  const double tilt_sense = sense_of("tilt", tilt_turn_in_camera, camera_from_world * nominal_tilt,
                                     tilt_link.scale, notes);
  const double tilt_scale = tilt_sense * std::abs(tilt_link.scale);
  found.tilt = tilt_sense * tilt_turn_in_camera.normalized();

  Eigen::Matrix3d at_zero = Eigen::Matrix3d::Zero();
  for (const SeenPose& pose : poses) {
    at_zero += rotation_by(-tilt_scale * pose.tilt * found.tilt) *
               rotation_by(-azimuth_scale * pose.azimuth * found.azimuth) *
               pose.camera_from_board.linear();
  }
  found.board = Eigen::Isometry3d::Identity();
  found.board.linear() = nearest_rotation(at_zero);
  solve_points(poses, azimuth_scale, tilt_scale, found);

  StageGeometry geometry = geometry_from(found, outward_normal(poses));
  geometry.azimuth_scale = azimuth_scale;
  geometry.tilt_scale = tilt_scale;
  geometry.azimuth_axis = azimuth_link.axis;
  geometry.tilt_axis = tilt_link.axis;
  geometry.camera = camera;
  return geometry;
}

}  // namespace gonio::calibration::geometry
