#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "gonio/basis/reconstruct.h"
#include "gonio/basis/training_set.h"
#include "gonio/design/candidates.h"
#include "gonio/design/exchange.h"
#include "gonio/design/image_importance.h"
#include "gonio/design/leave_one_out.h"
#include "gonio/design/pose_exchange.h"
#include "gonio/quality/metrics.h"
#include "gonio/quality/synthetic_samples.h"
#include "gonio/quality/trust_score.h"

namespace gonio::quality {

/// One way of measuring and reconstructing that is to be scored.
struct Contender {
  std::string label;
  int sample_count = 10;
  /// Given directions; empty: chosen anew in every fold, from its training materials only.
  std::vector<brdf::HalfDiff> directions;
  basis::ReconstructOptions reconstruct;
  PatchGeometry patch;
  /// Given: `sample_count` shots of a near field, chosen or given, instead of poses.
  std::optional<design::NearFieldSetup> near_field;
  /// Chosen poses of patches: by the directions of their centres alone, for comparison.
  bool chosen_as_points = false;
  /// Refine directions chosen as points by leave_one_out_exchange(), as always for few of them
  /// (kLeaveOneOutPoints).
  bool leave_one_out_design = false;
};

struct EvaluateOptions {
  /// 2 to the number of groups of siblings; as many leaves one group out at a time.
  int folds = 5;
  /// Indices of the materials to score; empty scores all. The others still train.
  std::vector<std::size_t> tested;
  int components = basis::kDefaultComponents;
  design::ExchangeOptions design;  ///< but for sample_count and seed, which stand elsewhere
  design::LeaveOneOutOptions leave_one_out;  ///< but for eta and seed, which are the exchange's
  /// Of contenders that measure patches: their poses are chosen for all that a frame shows. But for
  /// pose_count and seed.
  design::PoseDesignOptions pose_design;
  design::NearFieldOptions shot_design;  ///< of near-field contenders; but for shots and seed
  /// Of errors when directions are chosen; empty: what serves best for what a contender measures.
  std::optional<design::ImportanceBlend> importance;
  design::DirectionLimits limits;  ///< of directions chosen here
  SyntheticNoise noise;
  /// Also bands and verdict of every result, by the first draw of the noise; for methods that leave
  /// materials out. Half a second more per reconstruction.
  bool trust = false;
  int draws = 1;           ///< of the noise; figures are means over them
  std::uint64_t seed = 1;  ///< of the searches and the noise

  /// Throws std::invalid_argument naming the field.
  void validate(std::span<const basis::MaterialId> materials) const;
};

/// What was said of a result before the truth was looked at, and how true it was.
struct Trust {
  Coverage coverage;
  /// Outlook::expected_psnr_db; empty with too few training materials.
  std::optional<double> expected_psnr_db;
  std::optional<bool> trusted;
};

/// What a contender did on one material that neither basis, design nor any setting has seen.
struct MaterialScore {
  std::size_t material = 0;  ///< index into the training set
  int fold = 0;
  Comparison errors;
  std::optional<Trust> trust;  ///< where it was asked for and the method has it
};

/// Mean and quantiles over materials (linear between ranks).
struct Summary {
  double mean = 0.0;
  double median = 0.0;
  double tenth_percentile = 0.0;
  double ninetieth_percentile = 0.0;
};
Summary summarise(std::vector<double> values);

/// Directions a contender used in a fold and what was known about them beforehand.
struct FoldDesign {
  int fold = 0;
  std::vector<brdf::HalfDiff> directions;
  double condition_number = 0.0;
  double xu_metric = 0.0;  ///< mean error of the training rows, at the published eta = 40
};

struct ContenderResult {
  Contender contender;
  std::vector<MaterialScore> scores;  ///< by material
  std::vector<FoldDesign> designs;    ///< by fold

  Summary psnr_a_db() const;
  Summary psnr_b_db() const;
  Summary weighted_log_rmse() const;
  Summary grazing_log_rmse() const;
  Summary grazing_log_bias() const;
  Summary raw_rmse_per_sr() const;
  Summary mean_delta_e() const;  ///< CIEDE2000 under lighting A
};

/// Sent from the calling thread after each material and contender.
struct EvaluateProgress {
  int fold = 0;
  int folds = 0;
  std::size_t done = 0;  ///< reconstructions
  std::size_t total = 0;
};

/// The exact table of a material of the set, in the set's scale: its file read again, or a model
/// tabulated. Training data fill holes; a score must not.
using TruthSource = std::function<brdf::BrdfTable(std::size_t material)>;

/// Held-out evaluation. Fold of a material: the number of its group (basis::sibling_groups())
/// modulo `folds`; without siblings that number is its position. Basis, design and every setting
/// come from the other folds alone.
///
/// Memory   The training set, one basis, two tables.
/// Stop     Between reconstructions and within the searches for directions: returns empty.
/// Errors   std::invalid_argument: options, no contender, a contender's direction below the
///          horizon; NumericalError from training.
/// Determinism  Same seed, same figures, whatever the number of threads.
std::optional<std::vector<ContenderResult>> evaluate(
    const basis::TrainingSet& set, const Eigen::MatrixXd& gram, const TruthSource& truth,
    const std::vector<Contender>& contenders, const EvaluateOptions& options,
    const std::function<void(const EvaluateProgress&)>& progress = {},
    const std::stop_token& stop = {});

}  // namespace gonio::quality
