#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <map>
#include <stdexcept>
#include <string>

#include "gonio/design/candidates.h"
#include "gonio/design/near_field.h"
#include "gonio/design/pose_exchange.h"
#include "gonio/parallel/parallel.h"
#include "gonio/random/stream.h"

namespace gonio::design {
namespace {

constexpr std::size_t kShotBlock = 8;
// A shot is replaced only for more than rounding, so that a search cannot go round in circles.
constexpr double kLeastShotGain = 1e-9;
// How the time usually splits, for the progress shown.
constexpr double kInformationShare = 0.3;

using Shots = std::vector<std::size_t>;  // numbers of poses

struct Best {
  std::size_t pose = 0;
  double value = std::numeric_limits<double>::infinity();
};

/// Poses with their information, lower triangles packed in single precision.
class ShotField {
 public:
  ShotField(const basis::BasisRows& rows, const Eigen::MatrixXd& importance,
            const NearFieldSetup& setup, const PoseNoise& noise)
      : rows_(rows), setup_(setup), noise_(noise), k_(importance.rows()) {
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(importance);
    root_ = solver.eigenvectors() * solver.eigenvalues().cwiseMax(0.0).cwiseSqrt().asDiagonal();
  }

  std::size_t size() const { return poses_.size(); }
  const brdf::HalfDiff& pose(std::size_t number) const { return poses_[number]; }

  /// Adds poses; tells how many are done. Stops early on request, the rest then being left out.
  template <typename Tell>
  void add(const std::vector<brdf::HalfDiff>& poses, const std::stop_token& stop, Tell&& tell) {
    const std::size_t entries = triangle();
    constexpr std::size_t kPart = 512;
    for (std::size_t at = 0; at < poses.size() && !stop.stop_requested(); at += kPart) {
      const std::size_t end = std::min(at + kPart, poses.size());
      const std::size_t first = poses_.size();
      poses_.insert(poses_.end(), poses.begin() + static_cast<std::ptrdiff_t>(at),
                    poses.begin() + static_cast<std::ptrdiff_t>(end));
      packed_.resize(poses_.size() * entries);
      parallel::for_each_block(
          first, poses_.size(), kShotBlock, [&](std::size_t from, std::size_t to) {
            for (std::size_t i = from; i < to; ++i) {
              const Eigen::MatrixXd information =
                  near_field_information(rows_, near_field_view(poses_[i], setup_), noise_);
              float* out = packed_.data() + i * entries;
              for (Eigen::Index column = 0; column < k_; ++column) {
                for (Eigen::Index row = column; row < k_; ++row) {
                  *out++ = static_cast<float>(information(row, column));
                }
              }
            }
          });
      tell(end);
    }
  }

  /// 1 + the information of some shots (lower triangle).
  Eigen::MatrixXd known(const Shots& shots, std::size_t left_out) const {
    Eigen::MatrixXd sum = Eigen::MatrixXd::Identity(k_, k_);
    for (std::size_t i = 0; i < shots.size(); ++i) {
      if (i != left_out) add_to(sum, shots[i]);
    }
    return sum;
  }

  /// tr(K (known + information of a pose)^-1).
  double value_with(Eigen::MatrixXd known, std::size_t pose) const {
    add_to(known, pose);
    const Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>> factor(known);
    return factor.matrixL().solve(root_).squaredNorm();
  }

  /// The best of all poses beside what is known; the lowest number among equals.
  Best best(const Eigen::MatrixXd& known) const {
    return parallel::reduce_blocks(
        std::size_t{0}, size(), kShotBlock, Best{},
        [&](std::size_t from, std::size_t to) {
          Best part;
          for (std::size_t i = from; i < to; ++i) {
            const double value = value_with(known, i);
            if (value < part.value) part = {i, value};
          }
          return part;
        },
        [](Best& total, Best&& part) {
          if (part.value < total.value) total = part;
        });
  }

 private:
  std::size_t triangle() const { return static_cast<std::size_t>(k_ * (k_ + 1) / 2); }

  void add_to(Eigen::MatrixXd& sum, std::size_t pose) const {
    const float* in = packed_.data() + pose * triangle();
    for (Eigen::Index column = 0; column < k_; ++column) {
      for (Eigen::Index row = column; row < k_; ++row) {
        sum(row, column) += static_cast<double>(*in++);
      }
    }
  }

  const basis::BasisRows& rows_;
  const NearFieldSetup& setup_;
  const PoseNoise& noise_;
  Eigen::Index k_;
  Eigen::MatrixXd root_;  ///< of the importance
  std::vector<brdf::HalfDiff> poses_;
  std::vector<float> packed_;
};

/// Shots on their way, and the passes over all poses already made: starts soon meet.
class Alternation {
 public:
  explicit Alternation(const ShotField& field) : field_(field) {}

  double value_of(const Shots& shots) const {
    return field_.value_with(field_.known(shots, shots.size() - 1), shots.back());
  }

  /// False when stopped on the way; `shots` are then the best so far.
  bool run(Shots& shots, double& value, const std::stop_token& stop) {
    for (std::size_t at = 0, unchanged = 0; unchanged < shots.size();
         at = (at + 1) % shots.size()) {
      if (stop.stop_requested()) return false;
      Shots others = shots;
      others.erase(others.begin() + static_cast<std::ptrdiff_t>(at));
      std::sort(others.begin(), others.end());
      const auto [known, is_new] = passes_.try_emplace(others);
      if (is_new) known->second = field_.best(field_.known(others, others.size()));
      const Best& best = known->second;
      const bool better = value - best.value > kLeastShotGain * value;
      if (better) {
        shots[at] = best.pose;
        value = best.value;
      }
      unchanged = better ? 1 : unchanged + 1;
    }
    return true;
  }

 private:
  const ShotField& field_;
  std::map<Shots, Best> passes_;
};

bool allowed_centre(const brdf::HalfDiff& pose, Angle theta_max) {
  return within({theta_max, theta_max, Angle()}, pose);
}

}  // namespace

void NearFieldOptions::validate() const {
  const auto refuse = [](const std::string& why) {
    throw std::invalid_argument("near field: " + why);
  };
  noise.validate();
  if (shots < 1 || shots > 100) refuse("shots is " + std::to_string(shots) + ", expected 1 to 100");
  if (starts < 1) refuse("starts is " + std::to_string(starts) + ", expected 1 or more");
  if (design_px < 1) refuse("design_px is " + std::to_string(design_px) + ", expected 1 or more");
  if (refinements < 0 || refinements > 6) {
    refuse("refinements is " + std::to_string(refinements) + ", expected 0 to 6");
  }
  if (!(theta_max > Angle() && theta_max < Angle::from_degrees(90.0))) {
    refuse("theta_max must be above 0 and below 90 deg");
  }
}

NearFieldDesign choose_shots(const basis::Basis& basis, const Eigen::MatrixXd& importance,
                             const NearFieldSetup& setup, const NearFieldOptions& options,
                             const ProgressCallback& progress, const std::stop_token& stop) {
  options.validate();
  NearFieldSetup coarse = setup;
  coarse.image_px = std::min(setup.image_px, options.design_px);
  coarse.validate();
  if (importance.rows() != basis.components.cols() || importance.cols() != importance.rows()) {
    throw std::invalid_argument("near field: importance of " + std::to_string(importance.rows()) +
                                " x " + std::to_string(importance.cols()) + " for " +
                                std::to_string(basis.components.cols()) + " components");
  }
  const auto allowed = [&](const brdf::HalfDiff& pose) {
    return allowed_centre(pose, options.theta_max);
  };
  const std::vector<brdf::HalfDiff> grid = pose_grid(options.step_deg, allowed);
  if (grid.empty()) throw std::invalid_argument("near field: found no pose within the limits");

  const basis::BasisRows rows(basis);
  const double m = basis.row_count();
  Shots chosen;
  double value = std::numeric_limits<double>::infinity();
  const auto tell = [&](double fraction) {
    if (progress) progress({std::min(fraction, 1.0), std::isfinite(value) ? value / m : 0.0});
  };
  ShotField field(rows, importance, coarse, options.noise);
  field.add(grid, stop, [&](std::size_t done) {
    tell(kInformationShare * static_cast<double>(done) / static_cast<double>(grid.size()));
  });

  NearFieldDesign design;
  if (field.size() == 0) {  // stopped before anything was known
    design.finished = false;
    design.shots.assign(static_cast<std::size_t>(options.shots), grid.front());
    design.value = near_field_error(rows, importance, design.shots, coarse, options.noise);
    return design;
  }
  Alternation alternation(field);
  for (int start = 0; start < options.starts; ++start) {
    random::Stream draw(
        random::make_key(options.seed, "design.near_field", static_cast<std::uint64_t>(start)));
    Shots shots;
    for (int i = 0; i < options.shots; ++i) shots.push_back(draw.below(field.size()));
    double reached = alternation.value_of(shots);
    const bool ended = alternation.run(shots, reached, stop);
    design.starts += ended ? 1 : 0;
    if (reached < value) {
      value = reached;
      chosen = shots;
    }
    tell(kInformationShare + (1.0 - kInformationShare) * (start + 1.0) / options.starts);
    if (!ended) break;
  }

  // Around each shot at half the step, the others held, and so on.
  for (const std::size_t shot : chosen) design.shots.push_back(field.pose(shot));
  double step = options.step_deg;
  for (int halving = 0; halving < options.refinements && !stop.stop_requested(); ++halving) {
    step *= 0.5;
    ShotField near(rows, importance, coarse, options.noise);
    near.add(design.shots, {}, [](std::size_t) {});
    for (const brdf::HalfDiff& shot : design.shots) {
      near.add(poses_around(shot, step, 1, allowed), {}, [](std::size_t) {});
    }
    Shots shots;
    for (std::size_t i = 0; i < design.shots.size(); ++i) shots.push_back(i);
    Alternation local(near);
    value = local.value_of(shots);
    local.run(shots, value, stop);
    for (std::size_t i = 0; i < shots.size(); ++i) design.shots[i] = near.pose(shots[i]);
  }
  design.value = near_field_error(rows, importance, design.shots, coarse, options.noise);
  design.finished = !stop.stop_requested();
  if (design.finished) tell(1.0);
  return design;
}

}  // namespace gonio::design
