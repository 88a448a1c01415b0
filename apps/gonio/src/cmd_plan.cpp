#include <fmt/format.h>

#include <cmath>

#include "command.h"
#include "direction_choice.h"
#include "directions_input.h"
#include "gonio/basis/basis_file.h"
#include "gonio/design/importance.h"
#include "gonio/design/published_sets.h"
#include "json_text.h"
#include "near_field_plan.h"
#include "outputs.h"
#include "patch_geometry.h"
#include "plan_file.h"
#include "planning.h"
#include "pose_choice.h"
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
  std::string objective = "a";
  std::string weights = "auto";
  std::string patch = "auto";
  int samples = 0;
  double noise = -1.0;  ///< below 0: from the rig
  double percent_per_second = 0.0;
  std::uint64_t seed = 1;
  bool near_field = false;
  int shots = 2;
  NearFieldWords camera;
  bool explain = false;
  bool json = false;
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

std::string range(Angle from, Angle to) {
  return fmt::format("{:g} to {:g}", from.degrees(), to.degrees());
}

std::string figures_text(const DirectionFigures& figures) {
  const design::LatticeRegion& where = figures.uncovered.where;
  return fmt::format(
      "condition number {:.1f} (says little about the result), Xu metric {:.1f} (mean, eta 40)\n"
      "A: expected weighted log error {:.4f}; D: log volume left open {:.1f}\n"
      "pictures: {:.1f} dB expected, {:.1f} dB for the worst tenth (an estimate from the training\n"
      "  materials, each left out, without noise; standard error {:.1f} dB)\n"
      "largest uncovered region: theta_h {}, theta_d {}, phi_d {} deg,\n"
      "  {:.1f} % of the expected error, {:.3f} nepers rms there\n",
      figures.design.condition_number, figures.design.xu_metric, std::sqrt(figures.design.bayes_a),
      figures.design.bayes_d, figures.forecast.psnr_db, figures.forecast.tenth_percentile_db,
      figures.forecast.standard_error_db, range(where.theta_h_from, where.theta_h_to),
      range(where.theta_d_from, where.theta_d_to), range(where.phi_d_from, where.phi_d_to),
      100.0 * figures.uncovered.share, figures.uncovered.rms);
}

nlohmann::ordered_json number_or_null(double value) {
  return std::isfinite(value) ? nlohmann::ordered_json(value) : nlohmann::ordered_json(nullptr);
}

nlohmann::ordered_json figures_json(const DirectionFigures& figures) {
  const design::LatticeRegion& where = figures.uncovered.where;
  const auto degrees = [](Angle from, Angle to) {
    return nlohmann::ordered_json{from.degrees(), to.degrees()};
  };
  return {{"condition_number", number_or_null(figures.design.condition_number)},
          {"xu_metric", figures.design.xu_metric},
          {"bayes_a", figures.design.bayes_a},
          {"bayes_d", figures.design.bayes_d},
          {"expected_psnr_db", figures.forecast.psnr_db},
          {"expected_psnr_standard_error_db", figures.forecast.standard_error_db},
          {"expected_psnr_p10_db", figures.forecast.tenth_percentile_db},
          {"uncovered",
           {{"theta_h_deg", degrees(where.theta_h_from, where.theta_h_to)},
            {"theta_d_deg", degrees(where.theta_d_from, where.theta_d_to)},
            {"phi_d_deg", degrees(where.phi_d_from, where.phi_d_to)},
            {"share_of_error", figures.uncovered.share},
            {"rms", figures.uncovered.rms}}}};
}

nlohmann::ordered_json session_json(const acquisition::MeasurementPlan& plan) {
  nlohmann::ordered_json points = nlohmann::ordered_json::array();
  for (const auto& point : plan.points) {
    points.push_back({{"theta_h_deg", point.direction.theta_h.degrees()},
                      {"theta_d_deg", point.direction.theta_d.degrees()},
                      {"phi_d_deg", point.direction.phi_d.degrees()},
                      {"branch", rig::branch_name(point.pose)},
                      {"travel_s", point.travel_s},
                      {"predicted_s", point.predicted_s}});
  }
  return {{"travel_s", plan.travel_s},
          {"shortest_order", plan.exact_order},
          {"duration_s", plan.duration_s},
          {"points", points}};
}

DesignRequest request_from(const Options& options) {
  DesignRequest request;
  request.sample_count = options.samples;
  request.method = design_method(options.method);
  request.objective = design_objective(options.objective);
  request.weights = importance_blend(options.weights);
  if (options.noise >= 0.0) request.relative_noise = options.noise;
  request.percent_per_second = options.percent_per_second;
  request.seed = options.seed;
  if (request.percent_per_second > 0.0 && options.rig.empty()) {
    throw UsageError("--time-price needs --rig: exposures depend on it");
  }
  return request;
}

/// Poses are chosen for patches by the expected error; other objectives and what was published know
/// points.
PoseRequest pose_request(const Console& console, const Options& options, const RigFile* rig) {
  PoseRequest request;
  request.pose_count = options.samples;
  request.noise = planned_noise(rig);
  request.seed = options.seed;
  if (options.method != "exchange" || options.objective != "a" ||
      options.percent_per_second > 0.0) {
    if (options.patch != "auto" && options.patch != "0") {
      throw UsageError(fmt::format(
          "--patch {} goes with --method exchange, --objective a and no --time-price only",
          options.patch));
    }
    return request;
  }
  request.patch = planned_patch(options.patch, rig);
  if (rig == nullptr && options.patch == "auto" && options.samples > 0) {
    console.say(fmt::format("no rig: {} assumed, {:g} mm from the camera and {:g} mm from the lamp",
                            to_text(request.patch), request.patch.camera_distance_mm,
                            request.patch.lamp_distance_mm));
  }
  return request;
}

int plan_near_field(Context& context, const Options& options) {
  if (options.basis.empty() || options.samples > 0 || !options.rig.empty()) {
    throw UsageError("--near-field needs --basis, and --shots instead of --samples and --rig");
  }
  require_output(options.out, options.force, {options.basis, options.directions});
  const design::NearFieldSetup setup = near_field_setup(options.camera);
  std::vector<brdf::HalfDiff> shots;
  if (!options.directions.empty()) {
    for (const samples::Direction& each :
         directions_input(options.directions, samples::BelowHorizon::Refuse)) {
      shots.push_back(each.angles);
    }
  }
  const basis::Basis basis = [&] {
    const PhaseTimer timer(context.console, "reading the basis");
    return basis::read_basis(options.basis);
  }();
  if (shots.empty()) {
    shots = choose_shots(context.console, basis, setup, options.shots, options.seed, context.stop);
    context.check_stop();
  }
  files::write_text_file(
      options.out,
      directions_text(shots,
                      {fmt::format("gonio plan {}", version_text()),
                       fmt::format("centres of {} near-field shots, field of view {:g} deg, "
                                   "camera {:g} mm, {} lamp; basis {}, seed {}",
                                   shots.size(), options.camera.fov_deg, options.camera.camera_mm,
                                   options.camera.lamp_mm > 0.0 ? "near" : "directional",
                                   basis_fingerprint(basis).substr(0, 12), options.seed)}),
      overwrite(options.force));
  context.console.result(near_field_text(basis, shots, setup));
  context.console.say(fmt::format("{}: {} shots", options.out, shots.size()));
  return kSuccess;
}

int plan(Context& context, const Options& options) {
  if (options.near_field) return plan_near_field(context, options);
  const bool from_list = !options.directions.empty();
  if (from_list == (options.samples > 0)) {
    throw UsageError("give either --samples with --basis to choose directions, or --directions");
  }
  if (!from_list && options.basis.empty()) throw UsageError("--samples needs --basis");
  if (options.json && !options.explain) throw UsageError("--json goes with --explain");
  const DesignRequest request = request_from(options);
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
  const PoseRequest poses = pose_request(context.console, options, rig ? &*rig : nullptr);
  const design::ImportanceBlend weights =
      request.weights.value_or(poses.patch.is_point() ? design::ImportanceBlend::for_points()
                                                      : design::ImportanceBlend::for_patches());
  Eigen::MatrixXd importance;
  if (basis) importance = design::blended_importance(*basis, basis->left_vectors, weights);
  std::vector<std::string> comments{fmt::format("gonio plan {}", version_text())};
  if (from_list) {
    comments.push_back("directions from " +
                       std::filesystem::path(options.directions).filename().string());
  } else {
    const rig::Inverse* reach = inverse ? &*inverse : nullptr;
    const std::vector<brdf::HalfDiff> chosen =
        poses.patch.is_point()
            ? choose_directions(context.console, *basis, rig ? &*rig : nullptr, reach, request,
                                context.stop)
            : choose_poses(context.console, *basis, importance, reach, poses, context.stop);
    if (context.stop.stop_requested()) {
      context.console.warn("search stopped: the plan holds the best directions so far");
      comments.push_back("search stopped early");
    }
    for (const brdf::HalfDiff& angles : chosen) directions.push_back({angles, 0});
    const bool published = request.method != DesignMethod::exchange;
    comments.push_back(fmt::format(
        "{} directions by {}, {}, objective {}, weights {}, for basis {} ({} materials), seed {}",
        options.samples, options.method, to_text(poses.patch),
        published ? "as published" : options.objective, published ? "none" : to_text(weights),
        basis_fingerprint(*basis).substr(0, 12), basis->materials.size(), options.seed));
  }
  nlohmann::ordered_json explained = nlohmann::ordered_json::object();
  if (options.explain && basis) {
    std::vector<brdf::HalfDiff> angles;
    for (const samples::Direction& direction : directions) angles.push_back(direction.angles);
    const PhaseTimer timer(context.console, "figures of the design");
    const DirectionFigures figures = assess_directions(*basis, angles, weights);
    if (options.json) {
      explained["figures"] = figures_json(figures);
    } else {
      context.console.result(figures_text(figures) +
                             sample_size_text(*basis, importance, angles, poses));
    }
  }
  if (!rig) {
    std::vector<brdf::HalfDiff> angles;
    for (const samples::Direction& direction : directions) angles.push_back(direction.angles);
    files::write_text_file(options.out, directions_text(angles, comments),
                           overwrite(options.force));
    if (options.json) context.console.result(json_text(explained));
    context.console.say(fmt::format("{}: {} directions", options.out, angles.size()));
    return kSuccess;
  }
  acquisition::MeasurementPlan session = plan_poses(*rig, *inverse, directions, options.seed);
  refuse_unreachable(context.console, options.directions, session, options.skip_unreachable);
  std::vector<double> exposures_us;
  if (basis) {
    const basis::BasisRows rows(*basis);
    for (const auto& point : session.points) {
      exposures_us.push_back(expected_exposure_us(*rig, rows, point.direction));
    }
    predict_from_exposures(*rig, exposures_us, session);
  }
  comments.push_back(fmt::format("rig {}, travel {:.1f} s, session about {:.0f} s", rig->rig.name,
                                 session.travel_s, session.duration_s));
  files::write_text_file(options.out, plan_text(rig->rig, session, exposures_us, comments),
                         overwrite(options.force));
  if (options.json) {
    explained["session"] = session_json(session);
    context.console.result(json_text(explained));
  } else if (options.explain) {
    explain_plan(context, session);
  }
  context.console.say(fmt::format("{}: {} directions, about {}", options.out, session.points.size(),
                                  duration_text(session.duration_s)));
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
  command.choice("--method", options->method, {"exchange", "nielsen", "xu"},
                 "How to search: over all directions, or as published in 2015 or 2016");
  command.choice("--objective", options->objective, {"a", "d", "xu", "loo"},
                 "What the exchange lowers: expected error, volume left open, Xu's metric, or the "
                 "error of training materials left out");
  command.text(
      "--weights", options->weights,
      "Where errors matter: auto (by points or patches), uniform, solid-angle, image, or shares "
      "of them");
  command.number("--noise", options->noise, -1.0, 1.0,
                 "Relative standard deviation to plan for; below 0: what the rig's constants say");
  command.number("--time-price", options->percent_per_second, 0.0, 100.0,
                 "Per cent of the square error that a second of exposure is worth");
  command.text(
      "--patch", options->patch,
      "Choose poses for all that a frame shows: half width of the sample in mm, 0 for points, "
      "auto for the rig's own (25 without a rig)");
  command.flag("--near-field", options->near_field,
               "Choose centres of photographs taken from near, each pixel a direction");
  command.integer("--shots", options->shots, 1, 20, "How many, with --near-field");
  command.number("--fov", options->camera.fov_deg, 1.0, 120.0,
                 "Field of view of the square photograph, degrees");
  command.number("--camera-mm", options->camera.camera_mm, 1.0, 1e5,
                 "Distance of the camera, with --near-field");
  command.number("--lamp-mm", options->camera.lamp_mm, 0.0, 1e6,
                 "Distance of a point lamp, with --near-field; 0: directional light");
  command.number("--sample-mm", options->camera.sample_mm, 0.0, 1e5,
                 "Half width of the sample, with --near-field; 0: no edge in sight");
  command.seed(options->seed, "Of the search");
  command.flag("--explain", options->explain, "Print poses, times and figures of the design");
  command.flag("--json", options->json, "With --explain: as JSON");
  command.flag("--skip-unreachable", options->skip_unreachable,
               "Leave out listed directions the rig cannot measure");
  command.force(options->force);
  command.on_call(options, plan);
}

}  // namespace gonio::cli
