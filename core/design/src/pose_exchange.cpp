#include "gonio/design/pose_exchange.h"

#include <algorithm>
#include <functional>
#include <stdexcept>
#include <string>

#include "pose_pool.h"
#include "search_support.h"

namespace gonio::design {
namespace {

// How the time splits between the starts, all candidates and the refinement, for progress shown.
constexpr double kPoseStartShare = 0.4;
constexpr double kAllShare = 0.5;
// The best starts move this far among their neighbours before the best of them see all candidates:
// many then end in the same place, and a scan of all candidates costs a hundred times as much.
constexpr std::size_t kMovedStarts = 4;
constexpr double kMoveStep_deg = 2.0;
// Positions to either side of a chosen pose, and how often the neighbourhood may move along.
constexpr int kRefineReach = 3;
constexpr int kRefineRounds = 4;

std::vector<brdf::HalfDiff> neighbours(const std::vector<PoseMember>& members, double step_deg,
                                       const AllowedPose& allowed) {
  std::vector<brdf::HalfDiff> found;
  for (const PoseMember& member : members) {
    const auto around = poses_around(member.pose, step_deg, kRefineReach, allowed);
    found.insert(found.end(), around.begin(), around.end());
  }
  return found;
}

}  // namespace

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
    PoseTrial first = pool.greedy(count);
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
        tell(kPoseStartShare * (start + share_of(tried)) / options.starts, value);
      });
      design.starts += trials.back().finished ? 1 : 0;
    }
    break;
  }

  const auto move = [&](PoseTrial& trial, double step_deg,
                        const std::function<void(double share, double value)>& moved) {
    for (int round = 0; candidates.allowed && round < kRefineRounds; ++round) {
      if (stop.stop_requested()) return;
      const int before = trial.exchanges;
      PosePool pool(rows, neighbours(trial.members, step_deg, candidates.allowed), patch,
                    importance, options, candidates.accept);
      pool.exchange(trial, stop, [&](std::size_t tried, double value) {
        moved((round + share_of(tried)) / kRefineRounds, value);
      });
      if (trial.exchanges == before) return;
    }
  };

  if (wanted < candidates.poses.size()) {
    keep_best(trials, std::max(kMovedStarts, static_cast<std::size_t>(options.polished)));
    for (PoseTrial& trial : trials) {
      move(trial, kMoveStep_deg, [&](double, double value) { tell(kPoseStartShare, value); });
    }
  }
  keep_best(trials, static_cast<std::size_t>(options.polished));
  if (wanted < candidates.poses.size() && !stop.stop_requested()) {
    PosePool pool(rows, candidates.poses, patch, importance, options, candidates.accept);
    for (std::size_t i = 0; i < trials.size(); ++i) {
      pool.exchange(trials[i], stop, [&](std::size_t tried, double value) {
        tell(kPoseStartShare + kAllShare * (static_cast<double>(i) + share_of(tried)) /
                                   static_cast<double>(trials.size()),
             value);
      });
    }
  }
  keep_best(trials, 1);
  PoseTrial& chosen = trials.front();

  if (options.refine_step_deg > 0.0) {
    move(chosen, options.refine_step_deg, [&](double share, double value) {
      tell(kPoseStartShare + kAllShare + (1.0 - kPoseStartShare - kAllShare) * share, value);
    });
  }

  for (const PoseMember& member : chosen.members) design.poses.push_back(member.pose);
  design.value = expected_error(rows, importance, design.poses, patch, options.noise);
  design.exchanges = chosen.exchanges;
  design.finished = chosen.finished && !stop.stop_requested();
  if (design.finished) tell(1.0, chosen.value);
  return design;
}

}  // namespace gonio::design
