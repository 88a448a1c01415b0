#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <stop_token>
#include <vector>

#include "gonio/design/pose_exchange.h"
#include "pose_field.h"

namespace gonio::design {

/// A pose in a set, with the rows the search knows it by.
struct PoseMember {
  brdf::HalfDiff pose;
  Eigen::MatrixXd rows;
};

/// A set of poses on its way to a design.
struct PoseTrial {
  std::vector<PoseMember> members;
  double value = 0.0;    ///< tr(K M)
  bool finished = true;  ///< no swap helps among the candidates of the last pool
  int exchanges = 0;
};

/// Exchanges among some candidate poses.
///
/// Threads  One; the work inside is shared out.
class PosePool {
 public:
  using TrialCallback = std::function<void(std::size_t tried, double value)>;

  /// `importance`, `options` must outlive the pool; `accept` may be empty.
  PosePool(const basis::BasisRows& rows, std::vector<brdf::HalfDiff> poses,
           const PatchGeometry& patch, const Eigen::MatrixXd& importance,
           const PoseDesignOptions& options,
           const std::function<bool(const brdf::HalfDiff&)>& accept);

  /// One after another, each the best next, until the trial has so many members. Fewer when the
  /// pool has no more. Members that are there already need not be in the pool.
  PoseTrial greedy(std::size_t count, PoseTrial trial = {});

  /// Drawn evenly from the pool, which must have enough usable candidates.
  PoseTrial random_start(std::uint64_t start);

  /// Drops one after another and takes the best in its place until a whole round changes nothing,
  /// or until asked to stop. Never raises the value. The members need not be in the pool.
  void exchange(PoseTrial& trial, const std::stop_token& stop, const TrialCallback& tell);

 private:
  bool usable(std::size_t at);
  std::size_t pick(const std::vector<PoseMember>& members, std::size_t free);
  double value_of(const std::vector<PoseMember>& members) const;

  std::vector<brdf::HalfDiff> poses_;
  const Eigen::MatrixXd& importance_;
  const PoseDesignOptions& options_;
  std::function<bool(const brdf::HalfDiff&)> accept_;
  PoseField field_;
  std::vector<std::uint8_t> allowed_;
  std::vector<std::uint8_t> accepted_;  ///< asked already and accepted
};

}  // namespace gonio::design
