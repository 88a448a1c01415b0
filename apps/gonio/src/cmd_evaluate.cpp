#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "command.h"
#include "direction_choice.h"
#include "directions_input.h"
#include "gonio/console/suggest.h"
#include "gonio/design/published_sets.h"
#include "gonio/quality/evaluate.h"
#include "gonio/quality/verdict.h"
#include "gonio/rig/kinematics.h"
#include "json_text.h"
#include "materials_input.h"
#include "near_field_plan.h"
#include "noise_options.h"
#include "planning.h"
#include "siblings_input.h"

namespace gonio::cli {
namespace {

struct EvaluateOptions {
  std::vector<std::string> inputs;
  std::vector<std::string> excluded;
  ScaleWish scale;
  std::string directions;
  std::string siblings;
  std::vector<std::string> scored;
  std::vector<int> samples = {10};
  int folds = 5;
  int components = basis::kDefaultComponents;
  double patch_mm = 0.0;
  int shots = 0;
  NearFieldWords camera;
  NoiseWords noise;
  std::uint64_t seed = 1;
  std::string weights = "auto";
  bool chosen_as_points = false;
  bool leave_one_out = false;
  bool trust = false;
  bool json = false;
};

/// Positions of the materials named. Throws UsageError for a name that is not given.
std::vector<std::size_t> positions_of(const std::vector<std::string>& names,
                                      const TrainingInput& input) {
  std::vector<std::string> known;
  for (std::size_t i = 0; i < input.size(); ++i) known.push_back(input.name(i));
  std::vector<std::size_t> positions;
  for (const std::string& name : names) {
    const auto found = std::find(known.begin(), known.end(), name);
    if (found == known.end()) {
      throw UsageError(fmt::format("--score {}: no such material among the {} given{}", name,
                                   known.size(), did_you_mean(name, known)));
    }
    positions.push_back(static_cast<std::size_t>(found - known.begin()));
  }
  return positions;
}

std::vector<brdf::HalfDiff> usable_directions(const Console& console, const std::string& word) {
  std::vector<brdf::HalfDiff> directions;
  for (const samples::Direction& each : directions_input(word, samples::BelowHorizon::Keep)) {
    const brdf::HalfDiff& angles = each.angles;
    if (brdf::above_horizon(angles.theta_h, angles.theta_d, angles.phi_d)) {
      directions.push_back(angles);
    } else {
      console.warn(
          fmt::format("{}: direction {} is below the horizon and left out", word, to_text(angles)));
    }
  }
  if (directions.empty()) throw UsageError(word + ": found no usable direction");
  return directions;
}

nlohmann::ordered_json summary_json(const quality::Summary& summary) {
  return {{"mean", summary.mean},
          {"median", summary.median},
          {"p10", summary.tenth_percentile},
          {"p90", summary.ninetieth_percentile}};
}

/// How true bands and verdicts of a contender were; empty when they were not asked for.
std::string trust_text(const quality::ContenderResult& result) {
  double in_68 = 0.0;
  double in_95 = 0.0;
  int count = 0;
  int below = 0;
  int failed = 0;
  int flagged = 0;
  int false_alarms = 0;
  std::vector<std::pair<double, bool>> expectations;
  for (const quality::MaterialScore& score : result.scores) {
    if (!score.trust) continue;
    ++count;
    in_68 += score.trust->coverage.in_68;
    in_95 += score.trust->coverage.in_95;
    if (score.trust->coverage.in_95 < 0.9) ++below;
    const bool bad = score.errors.lighting_a.psnr_db < quality::kUsablePsnr_db;
    failed += bad ? 1 : 0;
    flagged += bad && score.trust->trusted == false ? 1 : 0;
    false_alarms += !bad && score.trust->trusted == false ? 1 : 0;
    if (score.trust->expected_psnr_db)
      expectations.emplace_back(*score.trust->expected_psnr_db, bad);
  }
  if (count == 0) return {};
  return fmt::format(
      "{}: bands hold {:.1f} % (68), {:.1f} % (95), {} of {} materials below 90 %; verdict: {} of "
      "{} "
      "below {:.0f} dB flagged, {} of {} others, area under ROC {:.3f}\n",
      result.contender.label, 100.0 * in_68 / count, 100.0 * in_95 / count, below, count, flagged,
      failed, quality::kUsablePsnr_db, false_alarms, count - failed,
      quality::area_under_roc(expectations));
}

int evaluate(Context& context, const EvaluateOptions& options) {
  if (options.shots == 0) refuse_near_field_options(options.camera, "--shots");
  if (options.shots > 0 && options.noise.tilt_deg > 0.0) {
    throw UsageError("--angle-error is not simulated for near-field photographs");
  }
  TrainingInput input = training_input(options.inputs, options.excluded, options.scale);
  if (!options.siblings.empty()) read_siblings(context.console, options.siblings, input);
  if (input.size() < 4) {
    throw UsageError(fmt::format("found {} materials, expected at least 4", input.size()));
  }
  for (std::size_t i = 0; i < input.size(); ++i) {
    report_conventions(context.console, input.material(i), Report::warnings);
  }
  std::vector<quality::Contender> contenders;
  const quality::PatchGeometry patch = quality::PatchGeometry::of_half_width(options.patch_mm);
  const auto add = [&](std::string label, int count, std::vector<brdf::HalfDiff> directions,
                       bool published) {
    quality::Contender contender;
    contender.label = std::move(label);
    contender.sample_count = directions.empty() ? count : static_cast<int>(directions.size());
    contender.directions = std::move(directions);
    if (published) {
      contender.reconstruct.method = basis::Method::nielsen;
    } else {
      contender.patch = patch;
    }
    contenders.push_back(std::move(contender));
  };
  for (const int count : options.samples) {
    add(fmt::format("chosen {}", count), count, {}, false);
    if (options.chosen_as_points && !patch.is_point()) {
      add(fmt::format("{} chosen as points", count), count, {}, false);
      contenders.back().chosen_as_points = true;
    }
    if (options.leave_one_out) {
      add(fmt::format("{} chosen by leave-one-out", count), count, {}, false);
      contenders.back().chosen_as_points = true;
      contenders.back().leave_one_out_design = true;
    }
  }
  if (!options.directions.empty()) {
    const auto directions = usable_directions(context.console, options.directions);
    add("given directions", 0, directions, false);
    add("given directions, published", 0, directions, true);
  }
  if (options.shots > 0) {
    const auto near_field = [&](std::string label, std::vector<brdf::HalfDiff> shots) {
      add(std::move(label), options.shots, std::move(shots), false);
      quality::Contender& contender = contenders.back();
      contender.near_field = near_field_setup(options.camera);
    };
    near_field(fmt::format("{} near-field shots", options.shots), {});
    near_field("published pair, near field", design::published_set("near-field-2").directions);
  }
  add("published ten, eta 40", 0, design::published_set("nielsen-10").directions, true);

  const basis::TrainingSet set = [&] {
    const PhaseTimer timer(context.console, "reading materials");
    Progress progress(context.console, "reading materials");
    return load_training_set(input, [&](double fraction) {
      context.check_stop();
      progress.update(fraction);
    });
  }();
  quality::EvaluateOptions how;
  how.folds = options.folds;
  how.components = options.components;
  how.noise = synthetic_noise(options.noise);
  how.seed = options.seed;
  how.importance = importance_blend(options.weights);
  how.trust = options.trust;
  how.tested = positions_of(options.scored, input);
  try {
    how.validate(set.materials());
  } catch (const std::invalid_argument& error) {
    throw UsageError(error.what());
  }
  const Eigen::MatrixXd gram = [&] {
    const PhaseTimer timer(context.console, "Gram matrix");
    return basis::centred_gram(set);
  }();
  Progress progress(context.console, "evaluating");
  const auto results = quality::evaluate(
      set, gram, [&](std::size_t i) { return load_table(input.material(i)); }, contenders, how,
      [&](const quality::EvaluateProgress& now) {
        progress.update(static_cast<double>(now.done) / static_cast<double>(now.total),
                        fmt::format("fold {} of {}", now.fold + 1, now.folds));
      },
      context.stop);
  if (!results) throw Interrupted();
  if (options.json) {
    nlohmann::ordered_json list = nlohmann::ordered_json::array();
    for (const quality::ContenderResult& result : *results) {
      nlohmann::ordered_json materials = nlohmann::ordered_json::array();
      for (const quality::MaterialScore& score : result.scores) {
        nlohmann::ordered_json one = {{"material", set.materials()[score.material].name},
                                      {"fold", score.fold},
                                      {"psnr_a_db", score.errors.lighting_a.psnr_db},
                                      {"psnr_b_db", score.errors.lighting_b.psnr_db},
                                      {"weighted_log_rmse", score.errors.lattice.weighted_log_rmse},
                                      {"grazing_log_rmse", score.errors.lattice.grazing_log_rmse},
                                      {"grazing_log_bias", score.errors.lattice.grazing_log_bias},
                                      {"raw_rmse_per_sr", score.errors.lattice.raw_rmse_per_sr}};
        if (score.trust) {
          one["coverage_68"] = score.trust->coverage.in_68;
          one["coverage_95"] = score.trust->coverage.in_95;
          one["expected_psnr_db"] = score.trust->expected_psnr_db
                                        ? nlohmann::ordered_json(*score.trust->expected_psnr_db)
                                        : nlohmann::ordered_json(nullptr);
          one["trusted"] = score.trust->trusted ? nlohmann::ordered_json(*score.trust->trusted)
                                                : nlohmann::ordered_json(nullptr);
        }
        materials.push_back(std::move(one));
      }
      list.push_back({{"method", result.contender.label},
                      {"samples", result.contender.sample_count},
                      {"psnr_a_db", summary_json(result.psnr_a_db())},
                      {"psnr_b_db", summary_json(result.psnr_b_db())},
                      {"weighted_log_rmse", summary_json(result.weighted_log_rmse())},
                      {"grazing_log_rmse", summary_json(result.grazing_log_rmse())},
                      {"grazing_log_bias", summary_json(result.grazing_log_bias())},
                      {"raw_rmse_per_sr", summary_json(result.raw_rmse_per_sr())},
                      {"mean_delta_e_a", summary_json(result.mean_delta_e())},
                      {"materials", materials}});
    }
    context.console.result(json_text(list));
    return kSuccess;
  }
  std::string text =
      fmt::format("{} materials, {} folds, each material left out of basis and design\n",
                  set.material_count(), options.folds);
  text += fmt::format("{:<30} {:>7} {:>7} {:>7} {:>9} {:>9} {:>8} {:>6}\n", "", "PSNR A", "10 %",
                      "PSNR B", "log RMSE", "grazing", "its bias", "dE00");
  for (const quality::ContenderResult& result : *results) {
    const quality::Summary psnr = result.psnr_a_db();
    text += fmt::format(
        "{:<30} {:7.2f} {:7.2f} {:7.2f} {:9.4f} {:9.4f} {:+8.4f} {:6.2f}\n", result.contender.label,
        psnr.mean, psnr.tenth_percentile, result.psnr_b_db().mean, result.weighted_log_rmse().mean,
        result.grazing_log_rmse().mean, result.grazing_log_bias().mean, result.mean_delta_e().mean);
  }
  for (const quality::ContenderResult& result : *results) text += trust_text(result);
  context.console.result(text);
  return kSuccess;
}

}  // namespace

void add_evaluate(const Command& root) {
  auto options = std::make_shared<EvaluateOptions>();
  const Command command =
      root.add("evaluate", "Held-out accuracy over many materials",
               "gonio evaluate BRDFDatabase/brdfs --samples 10 --folds 5 --json");
  command.texts(
      "FILES_OR_DIRS", options->inputs,
      "Material files (.binary, .bsdf, .brdf), folders of them, \"builtin\" or \"builtin:NAME\"",
      Need::required);
  command.integers("--samples", options->samples, 1, 1000,
                   "Directions to choose per fold; several numbers: each is scored");
  command.integer("--folds", options->folds, 2, 100000, "Parts the materials are split into");
  command.integer("--components", options->components, 1, 10000, "Of the basis");
  command.text("--directions", options->directions,
               "Score these as well: a CSV file or a published set");
  command.texts("--exclude", options->excluded, "Leave these materials out altogether");
  command.texts("--score", options->scored,
                "Score only these materials; the others still train (default: all)");
  add_siblings_option(command, options->siblings);
  command.number("--patch", options->patch_mm, 0.0, 500.0,
                 "Half width of the sample in mm whose directions every pose sees; 0: points");
  command.text("--weights", options->weights, "Where errors matter, as for plan");
  command.flag("--chosen-as-points", options->chosen_as_points,
               "Score poses of patches chosen by their centres alone as well");
  command.flag("--leave-one-out", options->leave_one_out,
               "Score directions chosen by the objective loo as well");
  add_scale_options(command, options->scale);
  command.integer("--shots", options->shots, 0, 20,
                  "Score this many near-field shots as well, and the published pair");
  add_near_field_options(command, options->camera);
  add_noise_options(command, options->noise);
  command.seed(options->seed, "Of search and noise");
  command.flag("--trust", options->trust,
               "Also how often bands hold the truth and whether failures were flagged");
  command.flag("--json", options->json, "Print JSON");
  command.on_call(options, evaluate);
}

}  // namespace gonio::cli
