#include <fmt/format.h>

#include "command.h"
#include "directions_input.h"
#include "gonio/basis/basis_file.h"
#include "gonio/design/published_sets.h"
#include "outputs.h"
#include "plan_file.h"
#include "planning.h"
#include "provenance.h"

namespace gonio::cli {

std::vector<samples::Direction> directions_input(const std::string& word,
                                                 samples::BelowHorizon below_horizon) {
  if (!std::filesystem::exists(word)) {
    for (const design::PublishedSet& set : design::published_sets()) {
      if (set.name != word) continue;
      std::vector<samples::Direction> directions;
      for (const brdf::HalfDiff& angles : set.directions) directions.push_back({angles, 0});
      return directions;
    }
  }
  return samples::read_directions(word, below_horizon);
}

namespace {

struct Options {
  std::string basis;
  std::string directions;
  std::string rig;
  std::string out;
  std::string method = "exchange";
  int samples = 0;
  std::uint64_t seed = 1;
  bool explain = false;
  bool skip_unreachable = false;
  bool force = false;
};

void explain_plan(Context& context, const acquisition::MeasurementPlan& plan) {
  std::string text;
  for (std::size_t i = 0; i < plan.points.size(); ++i) {
    const auto& point = plan.points[i];
    text += fmt::format("{:3}  {:<32} branch {}  travel {:5.1f} s  total {:5.1f} s\n", i + 1,
                        to_text(point.direction), rig::branch_name(point.pose), point.travel_s,
                        point.predicted_s);
  }
  text += fmt::format("travel {:.1f} s ({}), whole session about {}\n", plan.travel_s,
                      plan.exact_order ? std::string("the shortest order")
                                       : fmt::format("at best {:.1f} s", plan.lower_bound_s),
                      duration_text(plan.duration_s));
  context.console.result(text);
}

void explain_figures(Context& context, const design::DesignFigures& figures) {
  context.console.result(
      fmt::format("condition number {:.1f}, Xu metric (eta 40) {:.1f}, expected weighted log "
                  "error {:.3f}\n",
                  figures.condition_number, figures.xu_metric, std::sqrt(figures.bayes_a)));
}

int plan(Context& context, const Options& options) {
  const bool from_list = !options.directions.empty();
  if (from_list == (options.samples > 0)) {
    throw UsageError("give either --samples with --basis to choose directions, or --directions");
  }
  if (!from_list && options.basis.empty()) throw UsageError("--samples needs --basis");
  require_output(options.out, options.force, {options.basis, options.directions, options.rig});

  std::optional<RigFile> rig;
  std::optional<rig::Inverse> inverse;
  if (!options.rig.empty()) {
    rig = read_rig_file(options.rig);
    inverse.emplace(rig->rig, rig->branches);
  }
  std::vector<samples::Direction> directions;
  if (from_list) directions = directions_input(options.directions, samples::BelowHorizon::Refuse);
  std::optional<basis::Basis> basis;
  if (!options.basis.empty()) {
    const PhaseTimer timer(context.console, "reading the basis");
    basis = basis::read_basis(options.basis);
  }
  std::vector<std::string> comments{fmt::format("gonio plan {}", version_text())};
  if (from_list) {
    comments.push_back("directions from " +
                       std::filesystem::path(options.directions).filename().string());
  } else {
    DesignRequest request{options.samples, options.method == "nielsen", options.seed};
    const DesignedDirections chosen =
        choose_directions(context.console, *basis, inverse ? &*inverse : nullptr, request);
    for (const brdf::HalfDiff& angles : chosen.directions) directions.push_back({angles, 0});
    comments.push_back(fmt::format(
        "{} directions by {} for basis {} ({} materials), seed {}", options.samples, options.method,
        basis_fingerprint(*basis).substr(0, 12), basis->materials.size(), options.seed));
  }
  if (options.explain && basis) {
    std::vector<brdf::HalfDiff> angles;
    for (const samples::Direction& direction : directions) angles.push_back(direction.angles);
    explain_figures(context, assess_directions(*basis, angles));
  }
  if (!rig) {
    std::vector<brdf::HalfDiff> angles;
    for (const samples::Direction& direction : directions) angles.push_back(direction.angles);
    files::write_text_file(options.out, directions_text(angles, comments),
                           overwrite(options.force));
    context.console.say(fmt::format("{}: {} directions", options.out, angles.size()));
    return kSuccess;
  }
  acquisition::MeasurementPlan poses = plan_poses(*rig, *inverse, directions, options.seed);
  refuse_unreachable(context.console, options.directions, poses, options.skip_unreachable);
  std::vector<double> exposures_us;
  if (basis) {
    const basis::BasisRows rows(*basis);
    for (const auto& point : poses.points) {
      exposures_us.push_back(expected_exposure_us(*rig, rows, point.direction));
    }
    predict_from_exposures(*rig, exposures_us, poses);
  }
  comments.push_back(fmt::format("rig {}, travel {:.1f} s, session about {:.0f} s", rig->rig.name,
                                 poses.travel_s, poses.duration_s));
  files::write_text_file(options.out, plan_text(rig->rig, poses, exposures_us, comments),
                         overwrite(options.force));
  if (options.explain) explain_plan(context, poses);
  context.console.say(fmt::format("{}: {} directions, about {}", options.out, poses.points.size(),
                                  duration_text(poses.duration_s)));
  return kSuccess;
}

}  // namespace

void refuse_unreachable(const Console& console, const std::string& list,
                        const acquisition::MeasurementPlan& plan, bool skip) {
  for (const acquisition::RefusedDirection& refused : plan.refused) {
    const std::string place =
        list.empty()
            ? ""
            : list + ": " +
                  (refused.direction.line > 0 ? fmt::format("line {}: ", refused.direction.line)
                                              : std::string());
    const std::string what = fmt::format(
        "{}direction {} cannot be measured: {}: {}", place, to_text(refused.direction.angles),
        rig::to_string(refused.refusal.reason), refused.refusal.detail);
    if (!skip) {
      throw UsageError(what, plan.refused.size() > 1
                                 ? fmt::format("{} directions in all; --skip-unreachable leaves "
                                               "them out",
                                               plan.refused.size())
                                 : "--skip-unreachable leaves it out");
    }
    console.warn(what);
  }
  if (plan.points.empty()) throw UsageError("found no direction that can be measured");
}

void add_plan(const Command& root) {
  auto options = std::make_shared<Options>();
  const Command command =
      root.add("plan", "Choose directions, or order given ones, for a rig",
               "gonio plan --basis basis.h5 --samples 10 --rig rigs/simulated.toml --out plan.csv");
  command.text("--basis", options->basis, "Basis to choose for");
  command.integer("--samples", options->samples, 1, 1000, "How many directions to choose");
  command.text("--directions", options->directions,
               "Order these instead: a CSV file, or a published set such as nielsen-10");
  command.text("--rig", options->rig, "Rig file: only reachable directions, with poses and times");
  command.text("--out", options->out, "Plan to write (CSV)", Need::required);
  command.choice("--method", options->method, {"exchange", "nielsen"}, "How to choose");
  command.seed(options->seed, "Of the search");
  command.flag("--explain", options->explain, "Print poses, times and figures of the design");
  command.flag("--skip-unreachable", options->skip_unreachable,
               "Leave out listed directions the rig cannot measure");
  command.force(options->force);
  command.on_call(options, plan);
}

}  // namespace gonio::cli
