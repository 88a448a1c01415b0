#include "pose_pool.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "gonio/design/criteria.h"
#include "gonio/parallel/parallel.h"
#include "gonio/random/stream.h"
#include "search_support.h"

namespace gonio::design {
namespace {

// Changes that are kept add their rounding to the field; then it starts afresh.
constexpr int kChangesBetweenResets = 12;
constexpr std::size_t kPosesPerBlock = 64;

bool same(const brdf::HalfDiff& a, const brdf::HalfDiff& b) {
  return a.theta_h == b.theta_h && a.theta_d == b.theta_d && a.phi_d == b.phi_d;
}

/// The strongest combinations of the rows: A^T A stays, but for what is left out.
Eigen::MatrixXd compressed(const Eigen::MatrixXd& rows) {
  const auto rank = static_cast<Eigen::Index>(lanes::kMaxRank);
  if (rows.rows() <= rank) return rows;
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(rows * rows.transpose());
  return solver.eigenvectors().rightCols(rank).transpose() * rows;
}

Eigen::MatrixXd open_of(const std::vector<PoseMember>& members, Eigen::Index k) {
  Eigen::Index count = 0;
  for (const PoseMember& member : members) count += member.rows.rows();
  Eigen::MatrixXd all(count, k);
  Eigen::Index at = 0;
  for (const PoseMember& member : members) {
    all.middleRows(at, member.rows.rows()) = member.rows;
    at += member.rows.rows();
  }
  return open_share(all, 1.0);
}

}  // namespace

PosePool::PosePool(const basis::BasisRows& rows, std::vector<brdf::HalfDiff> poses,
                   const PatchGeometry& patch, const Eigen::MatrixXd& importance,
                   const PoseDesignOptions& options,
                   const std::function<bool(const brdf::HalfDiff&)>& accept)
    : poses_(std::move(poses)),
      importance_(importance),
      options_(options),
      accept_(accept),
      field_(poses_.size(),
             std::min(static_cast<std::size_t>(patch.sub_samples()), lanes::kMaxRank), importance),
      allowed_(poses_.size(), 1),
      accepted_(poses_.size(), accept ? 0 : 1) {
  parallel::for_each_block(0, poses_.size(), kPosesPerBlock, [&](std::size_t from, std::size_t to) {
    for (std::size_t i = from; i < to; ++i) {
      field_.set_rows(i, compressed(pose_rows(rows, poses_[i], patch, options.noise)));
    }
  });
}

PoseTrial PosePool::greedy(std::size_t count, PoseTrial trial) {
  const Eigen::Index k = importance_.rows();
  std::vector<PoseChange> added;
  field_.reset(open_of(trial.members, k));
  while (trial.members.size() < count) {
    field_.scan(added, nullptr, allowed_);
    const std::size_t next = pick(trial.members, trial.members.size());
    if (next == field_.size()) break;
    const Eigen::MatrixXd rows = field_.rows(next);
    added = {adding_pose(rows, open_of(trial.members, k), importance_)};
    trial.members.push_back({poses_[next], rows});
  }
  trial.value = value_of(trial.members);
  return trial;
}

PoseTrial PosePool::random_start(std::uint64_t start) {
  random::Stream draw(random::make_key(options_.seed, "design.pose_start", start));
  PoseTrial trial;
  while (trial.members.size() < static_cast<std::size_t>(options_.pose_count)) {
    const std::size_t next = draw.below(field_.size());
    const bool taken =
        std::any_of(trial.members.begin(), trial.members.end(),
                    [&](const PoseMember& member) { return same(member.pose, poses_[next]); });
    if (!taken && usable(next)) trial.members.push_back({poses_[next], field_.rows(next)});
  }
  trial.value = value_of(trial.members);
  return trial;
}

void PosePool::exchange(PoseTrial& trial, const std::stop_token& stop, const TrialCallback& tell) {
  std::vector<PoseMember>& members = trial.members;
  const std::size_t n = members.size();
  Eigen::MatrixXd open = open_of(members, importance_.rows());
  field_.reset(open);
  trial.finished = false;
  std::vector<PoseChange> pending;
  int kept = 0;
  std::size_t tried = 0;
  for (std::size_t at = 0, unchanged = 0; unchanged < n; at = (at + 1) % n) {
    if (stop.stop_requested()) return;
    const PoseChange drop = dropping_pose(members[at].rows, open, importance_);
    field_.scan(pending, &drop, allowed_);
    pending.clear();
    const std::size_t next = pick(members, at);
    bool better = false;
    if (next != field_.size() && !same(poses_[next], members[at].pose)) {
      const PoseMember old = std::move(members[at]);
      members[at] = {poses_[next], field_.rows(next)};
      const double value = value_of(members);
      better = trial.value - value > kLeastImprovement * std::abs(trial.value);
      if (better) {
        std::vector<PoseMember> others = members;
        others.erase(others.begin() + static_cast<std::ptrdiff_t>(at));
        const PoseChange add =
            adding_pose(members[at].rows, open_of(others, importance_.rows()), importance_);
        open = open_of(members, importance_.rows());
        if ((kept += 2) >= kChangesBetweenResets) {
          field_.reset(open);
          kept = 0;
        } else {
          pending = {drop, add};
        }
        trial.value = value;
        ++trial.exchanges;
      } else {
        members[at] = old;
      }
    }
    unchanged = better ? 1 : unchanged + 1;
    tell(++tried, trial.value);
  }
  trial.finished = true;
}

double PosePool::value_of(const std::vector<PoseMember>& members) const {
  return importance_.cwiseProduct(open_of(members, importance_.rows())).sum();
}

bool PosePool::usable(std::size_t at) {
  if (allowed_[at] == 0) return false;
  if (accepted_[at] == 0) {
    if (!accept_(poses_[at])) {
      allowed_[at] = 0;
      return false;
    }
    accepted_[at] = 1;
  }
  return true;
}

/// The best of the last scan that may be taken for members[free] (size(): for none of them).
std::size_t PosePool::pick(const std::vector<PoseMember>& members, std::size_t free) {
  for (;;) {
    const std::size_t next = field_.best();
    if (next == field_.size()) return next;
    bool taken = false;
    for (std::size_t i = 0; i < members.size(); ++i) {
      taken = taken || (i != free && same(members[i].pose, poses_[next]));
    }
    if (!taken && usable(next)) return next;
    field_.dismiss(next);
  }
}

}  // namespace gonio::design
