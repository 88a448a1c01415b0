#include "gonio/quality/evaluate.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <stdexcept>
#include <tuple>
#include <utility>

#include "gonio/basis/dense_field.h"
#include "gonio/basis/siblings.h"
#include "gonio/design/criteria.h"
#include "gonio/quality/verdict.h"

namespace gonio::quality {
namespace {

constexpr double kPoseStepDeg = 2.0;

/// Mean of several draws' figures, so that noise is judged by its expectation.
Comparison mean_of(const std::vector<Comparison>& draws) {
  Comparison mean = draws.front();
  const auto average = [&](auto member) {
    double sum = 0.0;
    for (const Comparison& draw : draws) sum += member(draw);
    return sum / static_cast<double>(draws.size());
  };
  const auto set = [&](auto member) {
    member(mean) = average([&](Comparison c) { return member(c); });
  };
  set([](Comparison& c) -> double& { return c.lattice.weighted_log_rmse; });
  set([](Comparison& c) -> double& { return c.lattice.weighted_log_bias; });
  set([](Comparison& c) -> double& { return c.lattice.grazing_log_rmse; });
  set([](Comparison& c) -> double& { return c.lattice.grazing_log_bias; });
  set([](Comparison& c) -> double& { return c.lattice.raw_rmse_per_sr; });
  set([](Comparison& c) -> double& { return c.lighting_a.psnr_db; });
  set([](Comparison& c) -> double& { return c.lighting_a.mean_delta_e; });
  set([](Comparison& c) -> double& { return c.lighting_b.psnr_db; });
  set([](Comparison& c) -> double& { return c.lighting_b.mean_delta_e; });
  return mean;
}

/// Everything a fold learns from its training materials.
class Fold {
 public:
  Fold(const basis::TrainingSet& set, const Eigen::MatrixXd& gram,
       const std::vector<std::size_t>& training, const EvaluateOptions& options,
       const design::Candidates& candidates, std::stop_token stop)
      : basis_(basis::train(set, gram, training, options.components)),
        options_(options),
        candidates_(candidates),
        stop_(std::move(stop)) {}

  const basis::Basis& basis() const { return basis_; }

  /// After a stop the best so far.
  std::vector<brdf::HalfDiff> directions_for(const Contender& contender) {
    if (!contender.directions.empty()) return contender.directions;
    if (contender.near_field) return shots_for(contender);
    const PatchGeometry patch = contender.chosen_as_points ? PatchGeometry{} : contender.patch;
    auto& chosen = chosen_[{contender.sample_count, refined(contender), patch.half_width_mm,
                            patch.grid, patch.camera_distance_mm, patch.lamp_distance_mm}];
    if (chosen.empty()) {
      if (!patch.is_point()) return chosen = poses_for(contender);
      for (const std::uint32_t cell : points_for(contender)) {
        chosen.push_back(design::direction_of_basis_cell(cell));
      }
    }
    return chosen;
  }

  FoldDesign describe(int fold, const std::vector<brdf::HalfDiff>& directions) const {
    const Eigen::MatrixXd rows = design::rows_at(basis::BasisRows(basis_), directions);
    return {
        fold, directions, design::condition_number(rows),
        design::xu_metric(rows, basis_.singular_values, basis_.left_vectors, basis::kPublishedEta)};
  }

 private:
  const Eigen::MatrixXd& importance(bool of_patches) {
    using design::ImportanceBlend;
    Eigen::MatrixXd& kept = importance_[options_.importance ? 0 : std::size_t{of_patches}];
    if (kept.size() == 0) {
      kept = design::blended_importance(
          basis_, basis_.left_vectors,
          options_.importance.value_or(of_patches ? ImportanceBlend::for_patches()
                                                  : ImportanceBlend::for_points()));
    }
    return kept;
  }

  static bool refined(const Contender& contender) {
    return contender.leave_one_out_design || contender.sample_count <= design::kLeaveOneOutPoints;
  }

  std::vector<brdf::HalfDiff> shots_for(const Contender& contender) {
    design::NearFieldOptions settings = options_.shot_design;
    settings.shots = contender.sample_count;
    settings.seed = options_.seed;
    return design::choose_shots(basis_, importance(true), *contender.near_field, settings, {},
                                stop_)
        .shots;
  }

  std::vector<brdf::HalfDiff> poses_for(const Contender& contender) {
    const auto allowed = [&](const brdf::HalfDiff& pose) {
      return design::within(options_.limits, pose);
    };
    design::PoseDesignOptions settings = options_.pose_design;
    settings.pose_count = contender.sample_count;
    settings.seed = options_.seed;
    return design::choose_poses(basis_, importance(true),
                                {design::pose_grid(kPoseStepDeg, allowed), allowed, {}},
                                contender.patch.coarse(), settings, {}, stop_)
        .poses;
  }

  std::vector<std::uint32_t> points_for(const Contender& contender) {
    design::ExchangeOptions settings = options_.design;
    settings.sample_count = contender.sample_count;
    settings.seed = options_.seed;
    const std::vector<std::uint32_t> found =
        design::exchange(basis_.components, importance(false), candidates_, settings, {}, stop_)
            .cells;
    if (!refined(contender)) return found;
    design::LeaveOneOutOptions refine = options_.leave_one_out;
    refine.eta = settings.eta;
    refine.seed = options_.seed;
    return design::leave_one_out_exchange(basis_.components, basis_.left_vectors, importance(false),
                                          candidates_, found, refine, {}, stop_)
        .cells;
  }

  /// Contenders that measure alike share their design.
  using Measurement = std::tuple<int, bool, double, int, double, double>;

  basis::Basis basis_;
  const EvaluateOptions& options_;
  const design::Candidates& candidates_;
  std::stop_token stop_;
  std::array<Eigen::MatrixXd, 2> importance_;  ///< of points, of patches
  std::map<Measurement, std::vector<brdf::HalfDiff>> chosen_;
};

}  // namespace

void EvaluateOptions::validate(std::span<const basis::MaterialId> materials) const {
  const auto refuse = [](const std::string& why) {
    throw std::invalid_argument("evaluate: " + why);
  };
  const std::size_t group_count = basis::count_groups(materials);
  if (folds < 2 || static_cast<std::size_t>(folds) > group_count) {
    refuse("folds is " + std::to_string(folds) + ", expected 2 to the number of " +
           (group_count == materials.size() ? "materials, " : "groups of siblings, ") +
           std::to_string(group_count));
  }
  for (const std::size_t material : tested) {
    if (material >= materials.size()) {
      refuse("there is no material " + std::to_string(material) + " to test");
    }
  }
  if (components < 1) refuse("components must be at least 1");
  if (draws < 1) refuse("draws must be at least 1");
}

Summary summarise(std::vector<double> values) {
  if (values.empty()) return {};
  std::sort(values.begin(), values.end());
  Summary summary;
  for (const double value : values) summary.mean += value;
  summary.mean /= static_cast<double>(values.size());
  const auto quantile = [&](double share) {
    const double rank = share * static_cast<double>(values.size() - 1);
    const auto below = static_cast<std::size_t>(rank);
    const std::size_t above = std::min(below + 1, values.size() - 1);
    const double part = rank - static_cast<double>(below);
    // Two equal ends must not meet as inf - inf.
    return part == 0.0 ? values[below] : (1.0 - part) * values[below] + part * values[above];
  };
  summary.median = quantile(0.5);
  summary.tenth_percentile = quantile(0.1);
  summary.ninetieth_percentile = quantile(0.9);
  return summary;
}

namespace {

template <typename Member>
Summary summarise_scores(const std::vector<MaterialScore>& scores, Member&& member) {
  std::vector<double> values;
  values.reserve(scores.size());
  for (const MaterialScore& score : scores) values.push_back(member(score.errors));
  return summarise(std::move(values));
}

std::optional<Trust> trust_in(const basis::Basis& basis, const samples::SampleSet& samples,
                              const basis::Fit& fit, const brdf::BrdfTable& found,
                              const brdf::BrdfTable& known) {
  if (fit.left_out_residuals.size() == 0 ||
      basis::count_groups(basis.materials) < basis::kFewestGroupsForBands) {
    return std::nullopt;
  }
  const basis::Uncertainty bands = basis::uncertainty(basis, fit);
  const Verdict verdict = judge(basis, samples, fit, found, &bands);
  Trust trust{coverage(known, basis, fit, bands), std::nullopt, verdict.trusted};
  if (verdict.outlook) trust.expected_psnr_db = verdict.outlook->expected_psnr_db;
  return trust;
}

}  // namespace

Summary ContenderResult::psnr_a_db() const {
  return summarise_scores(scores, [](const Comparison& c) { return c.lighting_a.psnr_db; });
}
Summary ContenderResult::psnr_b_db() const {
  return summarise_scores(scores, [](const Comparison& c) { return c.lighting_b.psnr_db; });
}
Summary ContenderResult::weighted_log_rmse() const {
  return summarise_scores(scores, [](const Comparison& c) { return c.lattice.weighted_log_rmse; });
}
Summary ContenderResult::grazing_log_rmse() const {
  return summarise_scores(scores, [](const Comparison& c) { return c.lattice.grazing_log_rmse; });
}
Summary ContenderResult::grazing_log_bias() const {
  return summarise_scores(scores, [](const Comparison& c) { return c.lattice.grazing_log_bias; });
}
Summary ContenderResult::raw_rmse_per_sr() const {
  return summarise_scores(scores, [](const Comparison& c) { return c.lattice.raw_rmse_per_sr; });
}
Summary ContenderResult::mean_delta_e() const {
  return summarise_scores(scores, [](const Comparison& c) { return c.lighting_a.mean_delta_e; });
}

std::optional<std::vector<ContenderResult>> evaluate(
    const basis::TrainingSet& set, const Eigen::MatrixXd& gram, const TruthSource& truth,
    const std::vector<Contender>& contenders, const EvaluateOptions& options,
    const std::function<void(const EvaluateProgress&)>& progress, const std::stop_token& stop) {
  const std::size_t count = set.material_count();
  options.validate(set.materials());
  if (contenders.empty()) throw std::invalid_argument("evaluate: no contender");

  const std::vector<std::size_t> groups = basis::sibling_groups(set.materials());
  std::vector<std::uint8_t> scored(count, options.tested.empty() ? 1 : 0);
  for (const std::size_t material : options.tested) scored[material] = 1;

  std::vector<ContenderResult> results;
  for (const Contender& contender : contenders) results.push_back({contender, {}, {}});
  EvaluateProgress state{
      0, options.folds, 0,
      contenders.size() * static_cast<std::size_t>(std::count(scored.begin(), scored.end(), 1))};
  const design::Candidates candidates{design::cells_within(options.limits), {}};

  for (int number = 0; number < options.folds; ++number) {
    std::vector<std::size_t> training;
    std::vector<std::size_t> testing;
    for (std::size_t i = 0; i < count; ++i) {
      if (groups[i] % static_cast<std::size_t>(options.folds) != static_cast<std::size_t>(number)) {
        training.push_back(i);
      } else if (scored[i] != 0) {
        testing.push_back(i);
      }
    }
    if (testing.empty()) continue;
    if (stop.stop_requested()) return std::nullopt;
    state.fold = number;
    Fold fold(set, gram, training, options, candidates, stop);
    std::vector<std::vector<brdf::HalfDiff>> directions;
    for (ContenderResult& result : results) {
      directions.push_back(fold.directions_for(result.contender));
      if (stop.stop_requested()) return std::nullopt;
      result.designs.push_back(fold.describe(number, directions.back()));
    }
    for (const std::size_t material : testing) {
      const brdf::BrdfTable known = truth(material);
      const brdf::TableBrdf model(known);
      for (std::size_t c = 0; c < results.size(); ++c) {
        std::vector<Comparison> draws;
        std::optional<Trust> trust;
        for (int draw = 0; draw < options.draws; ++draw) {
          if (stop.stop_requested()) return std::nullopt;
          const Contender& contender = results[c].contender;
          const std::size_t stream =
              material * static_cast<std::size_t>(options.draws) + static_cast<std::size_t>(draw);
          const samples::SampleSet samples =
              contender.near_field
                  ? near_field_samples(model, set.scale(), directions[c], *contender.near_field,
                                       options.noise, options.seed, stream)
                  : synthetic_samples(model, set.scale(), directions[c], contender.patch,
                                      options.noise, options.seed, stream);
          const basis::Fit fit = basis::fit(fold.basis(), samples, contender.reconstruct);
          const brdf::BrdfTable found = basis::expand(fold.basis(), fit.coefficients);
          draws.push_back(compare(known, found, set.mapping()));
          if (options.trust && draw == 0) {
            trust = trust_in(fold.basis(), samples, fit, found, known);
          }
        }
        results[c].scores.push_back({material, number, mean_of(draws), trust});
        ++state.done;
        if (progress) progress(state);
      }
    }
  }
  for (ContenderResult& result : results) {
    std::sort(
        result.scores.begin(), result.scores.end(),
        [](const MaterialScore& a, const MaterialScore& b) { return a.material < b.material; });
  }
  return results;
}

}  // namespace gonio::quality
