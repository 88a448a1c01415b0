#include "gonio/design/pose_exchange.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "gonio/brdf/merl_lattice.h"
#include "gonio/parallel/parallel.h"
#include "pose_pool.h"

namespace gonio::design {
namespace {

// How the time splits between the starts, all candidates and the refinement, for progress shown.
constexpr double kStartShare = 0.4;
constexpr double kAllShare = 0.5;
constexpr double kUsualSweeps = 4.0;
// Positions to either side of a chosen pose, and how often the neighbourhood may move along.
constexpr int kRefineReach = 3;
constexpr int kRefineRounds = 4;

/// 90 sqrt(theta_h / 90 deg) and back.
double spaced(Angle theta_h) { return 90.0 * std::sqrt(theta_h.degrees() / 90.0); }
Angle unspaced(double t) { return Angle::from_degrees(t * t / 90.0); }

std::vector<brdf::HalfDiff> even_selection(const std::vector<brdf::HalfDiff>& poses,
                                           std::size_t wanted) {
  if (poses.size() <= wanted) return poses;
  std::vector<brdf::HalfDiff> selection(wanted);
  for (std::size_t i = 0; i < wanted; ++i) {
    selection[i] = poses[(2 * i + 1) * poses.size() / (2 * wanted)];
  }
  return selection;
}

/// Positions around the chosen poses that may be taken.
std::vector<brdf::HalfDiff> neighbours(const std::vector<PoseMember>& members, double step_deg,
                                       const std::function<bool(const brdf::HalfDiff&)>& allowed) {
  std::vector<brdf::HalfDiff> found;
  for (const PoseMember& member : members) {
    for (int a = -kRefineReach; a <= kRefineReach; ++a) {
      for (int b = -kRefineReach; b <= kRefineReach; ++b) {
        for (int c = -kRefineReach; c <= kRefineReach; ++c) {
          const double t = spaced(member.pose.theta_h) + a * step_deg;
          const double theta_d = member.pose.theta_d.degrees() + b * step_deg;
          double phi_d = member.pose.phi_d.degrees() + c * step_deg;
          if (t < 0.0 || t > 90.0 || theta_d < 0.0 || theta_d > 90.0) continue;
          // By reciprocity phi_d has a period of 180 deg.
          if (phi_d < 0.0) phi_d += 180.0;
          if (phi_d >= 180.0) phi_d -= 180.0;
          const brdf::HalfDiff pose{unspaced(t), Angle::from_degrees(theta_d),
                                    Angle::from_degrees(phi_d), Angle()};
          if (brdf::above_horizon(pose.theta_h, pose.theta_d, pose.phi_d) && allowed(pose)) {
            found.push_back(pose);
          }
        }
      }
    }
  }
  return found;
}

void keep_best(std::vector<PoseTrial>& trials, std::size_t count) {
  std::stable_sort(trials.begin(), trials.end(),
                   [](const PoseTrial& a, const PoseTrial& b) { return a.value < b.value; });
  if (trials.size() > count) trials.resize(count);
}

}  // namespace

std::vector<brdf::HalfDiff> pose_grid(double step_deg,
                                      const std::function<bool(const brdf::HalfDiff&)>& allowed) {
  if (!(step_deg >= 0.5 && step_deg <= 45.0)) {
    throw std::invalid_argument("pose grid: step is " + std::to_string(step_deg) +
                                " deg, expected 0.5 to 45");
  }
  const auto along = [&](double range) { return static_cast<std::size_t>(range / step_deg); };
  const auto angle = [&](std::size_t i) { return step_deg * (static_cast<double>(i) + 0.5); };
  const std::size_t theta_h_count = along(90.0);
  using Poses = std::vector<brdf::HalfDiff>;
  return parallel::reduce_blocks(
      0, theta_h_count, 1, Poses(),
      [&](std::size_t i, std::size_t) {
        Poses part;
        for (std::size_t j = 0; j < along(90.0); ++j) {
          for (std::size_t k = 0; k < along(180.0); ++k) {
            const brdf::HalfDiff pose{unspaced(angle(i)), Angle::from_degrees(angle(j)),
                                      Angle::from_degrees(angle(k)), Angle()};
            if (!brdf::above_horizon(pose.theta_h, pose.theta_d, pose.phi_d)) continue;
            if (!allowed || allowed(pose)) part.push_back(pose);
          }
        }
        return part;
      },
      [](Poses& all, Poses&& part) { all.insert(all.end(), part.begin(), part.end()); });
}

void PoseDesignOptions::validate() const {
  const auto refuse = [](const std::string& why) {
    throw std::invalid_argument("pose design: " + why);
  };
  noise.validate();
  if (pose_count < 1)
    refuse("pose_count is " + std::to_string(pose_count) + ", expected 1 or more");
  if (starts < 1) refuse("starts is " + std::to_string(starts) + ", expected 1 or more");
  if (polished < 1) refuse("polished is " + std::to_string(polished) + ", expected 1 or more");
  if (start_candidates < 1) refuse("start_candidates is 0, expected 1 or more");
  if (!(refine_step_deg >= 0.0 && refine_step_deg <= 45.0)) {
    refuse("refine_step_deg is " + std::to_string(refine_step_deg) + ", expected 0 to 45");
  }
}

PoseDesign choose_poses(const basis::Basis& basis, const Eigen::MatrixXd& importance,
                        const PoseCandidates& candidates, const PatchGeometry& patch,
                        const PoseDesignOptions& options, const ProgressCallback& progress,
                        const std::stop_token& stop) {
  options.validate();
  patch.validate();
  if (importance.rows() != basis.components.cols() || importance.cols() != importance.rows()) {
    throw std::invalid_argument("pose design: importance of " + std::to_string(importance.rows()) +
                                " x " + std::to_string(importance.cols()) + " for " +
                                std::to_string(basis.components.cols()) + " components");
  }
  const basis::BasisRows rows(basis);
  const auto count = static_cast<std::size_t>(options.pose_count);
  const double per_trial = kUsualSweeps * static_cast<double>(count);
  double best = 0.0;
  double told = 0.0;
  const auto tell = [&](double fraction, double value) {
    told = std::max(told, std::min(fraction, 1.0));
    best = best == 0.0 ? value : std::min(best, value);
    if (progress) progress({told, best / basis.row_count()});
  };
  const auto share_of = [&](std::size_t tried) {
    return std::min(1.0, static_cast<double>(tried) / per_trial);
  };

  PoseDesign design;
  std::vector<PoseTrial> trials;
  std::size_t wanted = std::max(options.start_candidates, 8 * count);
  for (;; wanted *= 8) {
    const bool all = wanted >= candidates.poses.size();
    PosePool pool(rows, even_selection(candidates.poses, wanted), patch, importance, options,
                  candidates.accept);
    PoseTrial first = pool.greedy();
    if (first.members.size() < count) {
      if (!all) continue;
      throw std::invalid_argument("pose design: only " + std::to_string(first.members.size()) +
                                  " usable poses for " + std::to_string(count));
    }
    trials.push_back(std::move(first));
    for (int start = 0; start < options.starts; ++start) {
      if (start > 0) {
        if (stop.stop_requested()) break;
        trials.push_back(pool.random_start(static_cast<std::uint64_t>(start)));
      }
      pool.exchange(trials.back(), stop, [&](std::size_t tried, double value) {
        tell(kStartShare * (start + share_of(tried)) / options.starts, value);
      });
      design.starts += trials.back().finished ? 1 : 0;
    }
    break;
  }

  keep_best(trials, static_cast<std::size_t>(options.polished));
  if (wanted < candidates.poses.size() && !stop.stop_requested()) {
    PosePool pool(rows, candidates.poses, patch, importance, options, candidates.accept);
    for (std::size_t i = 0; i < trials.size(); ++i) {
      pool.exchange(trials[i], stop, [&](std::size_t tried, double value) {
        tell(kStartShare + kAllShare * (static_cast<double>(i) + share_of(tried)) /
                               static_cast<double>(trials.size()),
             value);
      });
    }
  }
  keep_best(trials, 1);
  PoseTrial& chosen = trials.front();

  if (candidates.allowed && options.refine_step_deg > 0.0) {
    for (int round = 0; round < kRefineRounds && !stop.stop_requested(); ++round) {
      const int before = chosen.exchanges;
      PosePool pool(rows, neighbours(chosen.members, options.refine_step_deg, candidates.allowed),
                    patch, importance, options, candidates.accept);
      pool.exchange(chosen, stop, [&](std::size_t tried, double value) {
        tell(kStartShare + kAllShare +
                 (1.0 - kStartShare - kAllShare) * (round + share_of(tried)) / kRefineRounds,
             value);
      });
      if (chosen.exchanges == before) break;
    }
  }

  for (const PoseMember& member : chosen.members) design.poses.push_back(member.pose);
  design.value = expected_error(rows, importance, design.poses, patch, options.noise);
  design.exchanges = chosen.exchanges;
  design.finished = chosen.finished && !stop.stop_requested();
  if (design.finished) tell(1.0, chosen.value);
  return design;
}

}  // namespace gonio::design
