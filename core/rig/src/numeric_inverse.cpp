#include "numeric_inverse.h"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>

#include "direction_jacobian.h"

namespace gonio::rig {
namespace {

constexpr int kMaxIterations = 80;
constexpr double kResidualFloor = 1e-15;  // residual of unit vectors that cannot be improved
constexpr double kMaxStep = 0.5;          // rad: beyond it the linear model means nothing
constexpr double kFirstDamping = 1e-3;
constexpr double kMinDamping = 1e-14;
constexpr double kMaxDamping = 1e8;

using Residual = Eigen::Matrix<double, 6, 1>;

Eigen::Matrix3d turn_about_normal(double psi) {
  return Eigen::AngleAxisd(psi, Eigen::Vector3d::UnitZ()).toRotationMatrix();
}

Residual residual_of(const brdf::DirectionPair& pair, double psi,
                     const brdf::DirectionPair& target) {
  const Eigen::Matrix3d turn = turn_about_normal(psi);
  Residual r;
  r << turn * pair.wi - target.wi, turn * pair.wo - target.wo;
  return r;
}

/// Derivatives by the joints, then by psi.
Eigen::MatrixXd jacobian_of(const DirectionJacobian& at, double psi) {
  const Eigen::Matrix3d turn = turn_about_normal(psi);
  const Eigen::Index axes = at.d_wi.cols();
  Eigen::MatrixXd jacobian(6, axes + 1);
  jacobian.topLeftCorner(3, axes) = turn * at.d_wi;
  jacobian.bottomLeftCorner(3, axes) = turn * at.d_wo;
  jacobian.col(axes) << Eigen::Vector3d::UnitZ().cross(turn * at.pair.wi),
      Eigen::Vector3d::UnitZ().cross(turn * at.pair.wo);
  return jacobian;
}

/// What one radian of each unknown is worth as a turn: 1, but for slides what it turns directions
/// by, since their screws make many turns.
Eigen::VectorXd turns_per_radian(const RigDescription& rig, const Eigen::MatrixXd& jacobian) {
  Eigen::VectorXd turns = Eigen::VectorXd::Ones(jacobian.cols());
  for (const Chain* chain : {&rig.camera, &rig.lamp, &rig.sample}) {
    for (const ChainLink& link : chain->links) {
      const auto k = static_cast<Eigen::Index>(link.axis);
      if (link.lead_mm_per_turn != 0.0) turns[k] = jacobian.col(k).norm();
    }
  }
  return turns;
}

/// argmin |J x + r|^2 + damping |D x|^2, D = column norms of J; shortened to kMaxStep.
Eigen::VectorXd damped_step(const Eigen::MatrixXd& jacobian, const Eigen::VectorXd& turns,
                            const Residual& r, double damping) {
  const Eigen::Index unknowns = jacobian.cols();
  const double floor = 1e-6 * jacobian.colwise().norm().maxCoeff();  // joints without effect
  Eigen::MatrixXd stacked = Eigen::MatrixXd::Zero(6 + unknowns, unknowns);
  stacked.topRows(6) = jacobian;
  for (Eigen::Index k = 0; k < unknowns; ++k) {
    stacked(6 + k, k) = std::sqrt(damping) * std::max(jacobian.col(k).norm(), floor);
  }
  Eigen::VectorXd right = Eigen::VectorXd::Zero(6 + unknowns);
  right.head(6) = -r;
  Eigen::VectorXd step = stacked.colPivHouseholderQr().solve(right);
  const double longest = step.cwiseProduct(turns).cwiseAbs().maxCoeff();
  if (longest > kMaxStep) step *= kMaxStep / longest;
  return step;
}

Joints moved(const RigDescription& rig, const Joints& joints, const Eigen::VectorXd& step,
             StayWithinLimits within_limits) {
  Joints result = joints;
  for (std::size_t k = 0; k < joints.size(); ++k) {
    result[k] += Angle::from_radians(step[static_cast<Eigen::Index>(k)]);
    if (within_limits == StayWithinLimits::Yes) {
      result[k] = std::clamp(result[k], rig.axes[k].min, rig.axes[k].max);
    }
  }
  return result;
}

brdf::DirectionPair nominal_directions(const RigDescription& rig, const Joints& joints) {
  return forward(rig, joints).directions_at(Eigen::Vector3d::Zero());
}

}  // namespace

Angle best_turn(const brdf::DirectionPair& from, const brdf::DirectionPair& to) {
  const double sine = from.wi.x() * to.wi.y() - from.wi.y() * to.wi.x() + from.wo.x() * to.wo.y() -
                      from.wo.y() * to.wo.x();
  const double cosine = from.wi.x() * to.wi.x() + from.wi.y() * to.wi.y() +
                        from.wo.x() * to.wo.x() + from.wo.y() * to.wo.y();
  return Angle::from_radians(std::atan2(sine, cosine));
}

NumericSolution descend(const RigDescription& rig, const brdf::DirectionPair& target,
                        const Joints& seed, StayWithinLimits within_limits) {
  Joints joints = moved(rig, seed, Eigen::VectorXd::Zero(static_cast<Eigen::Index>(seed.size())),
                        within_limits);
  double psi = best_turn(nominal_directions(rig, joints), target).radians();
  Residual r = residual_of(nominal_directions(rig, joints), psi, target);
  double damping = kFirstDamping;
  for (int i = 0; i < kMaxIterations && r.norm() > kResidualFloor && damping < kMaxDamping; ++i) {
    const Eigen::MatrixXd jacobian = jacobian_of(direction_jacobian(rig, joints), psi);
    const Eigen::VectorXd turns = turns_per_radian(rig, jacobian);
    // Steps that make it worse cost only residuals, not another Jacobian.
    bool improved = false;
    while (!improved && damping < kMaxDamping) {
      const Eigen::VectorXd step = damped_step(jacobian, turns, r, damping);
      const Joints trial = moved(rig, joints, step, within_limits);
      const double trial_psi = psi + step[step.size() - 1];
      const Residual trial_r = residual_of(nominal_directions(rig, trial), trial_psi, target);
      improved = trial_r.norm() < r.norm();
      if (!improved) {
        damping *= 10.0;
        continue;
      }
      joints = trial;
      psi = trial_psi;
      r = trial_r;
      damping = std::max(damping * 0.1, kMinDamping);
    }
  }
  return {joints, r.norm()};
}

}  // namespace gonio::rig
