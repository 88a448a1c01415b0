#include <fmt/format.h>

#include "command.h"
#include "direction_choice.h"
#include "directions_input.h"
#include "gonio/basis/basis_file.h"
#include "gonio/files/text_file.h"
#include "gonio/setup/simulated_rig.h"
#include "json_text.h"
#include "near_field_plan.h"
#include "outputs.h"
#include "patch_geometry.h"
#include "plan_explanation.h"
#include "plan_file.h"
#include "plan_options.h"
#include "planning.h"
#include "pose_choice.h"
#include "provenance.h"
#include "session_preflight.h"

namespace gonio::cli {
namespace {

DesignRequest design_request(const PlanOptions& options) {
  DesignRequest request;
  request.sample_count = options.samples;
  request.method = design_method(options.method);
  request.objective = design_objective(options.objective);
  request.weights = importance_blend(options.weights);
  request.relative_noise = options.relative_noise();
  request.percent_per_second = options.percent_per_second;
  request.seed = options.seed;
  return request;
}

/// What was really lowered, for the plan's comment.
std::string objective_text(const DesignRequest& request, bool points) {
  switch (request.objective) {
    case DesignObjective::a:
      return "a";
    case DesignObjective::d:
      return "d";
    case DesignObjective::xu:
      return "xu";
    case DesignObjective::loo:
      return "a, then loo";
    case DesignObjective::automatic:
      break;
  }
  return points && refined_by_leave_one_out(request) ? "a, then loo" : "a";
}

PoseRequest pose_request(const PlanOptions& options, const KnownRig* rig) {
  PoseRequest request;
  request.pose_count = options.samples;
  request.noise = planned_noise(rig, options.relative_noise());
  request.seed = options.seed;
  // check_plan_options() refuses --patch with what knows points only.
  const bool expected_error = options.objective == "auto" || options.objective == "a";
  if (options.method != "exchange" || !expected_error || options.percent_per_second > 0.0) {
    return request;
  }
  request.patch = planned_patch(options.patch, rig);
  return request;
}

basis::Basis read_basis(const Console& console, const std::string& path) {
  const PhaseTimer timer(console, "reading the basis");
  return basis::read_basis(path);
}

std::vector<brdf::HalfDiff> angles_of(const std::vector<samples::Direction>& directions) {
  std::vector<brdf::HalfDiff> angles;
  for (const samples::Direction& direction : directions) angles.push_back(direction.angles);
  return angles;
}

/// A search that was stopped has still found something: warns and adds the plan's comment.
void say_if_stopped(const Context& context, std::vector<std::string>& comments) {
  if (!context.stop.stop_requested()) return;
  context.console.warn("search stopped: the plan holds the best directions so far");
  comments.emplace_back("search stopped early");
}

/// Puts the times of a session's forecast into a plan, by the average material it was made for.
/// Returns how long the session takes, for people; a warning when it would be refused.
std::string foresee(const Console& console, const KnownRig& rig,
                    const std::vector<double>& exposures_us, acquisition::MeasurementPlan& plan) {
  SessionSetup session;
  session.rig = rig.file;
  session.instrument = rig.constants;
  session.plan = plan;
  session.exposures_us = exposures_us;
  session.simulated = rig.file.driver == RigFile::Driver::simulated;
  const acquisition::Preflight found = preflight_session(session).found;
  if (const acquisition::Check* refusal = found.refusal()) {
    console.warn("gonio measure would refuse this plan: " + refusal->text);
  }
  if (!found.forecast) return "of a duration that is not known";
  use_forecast(*found.forecast, plan);
  return "about " + to_text(found.forecast->total_s);
}

int plan_near_field(Context& context, const PlanOptions& options) {
  const design::ImportanceBlend weights =
      importance_blend(options.weights).value_or(design::ImportanceBlend::for_patches());
  require_output(options.out, options.force, {options.basis, options.directions});
  const design::NearFieldSetup setup = near_field_setup(options.camera);
  const design::PoseNoise noise = planned_noise(nullptr, options.relative_noise());
  std::vector<brdf::HalfDiff> shots;
  if (!options.directions.empty()) {
    shots = angles_of(directions_input(options.directions, samples::BelowHorizon::Refuse));
  }
  const basis::Basis basis = read_basis(context.console, options.basis);
  context.check_stop();
  const Eigen::MatrixXd importance = design::blended_importance(basis, basis.left_vectors, weights);
  context.check_stop();
  std::vector<std::string> comments{fmt::format("gonio plan {}", version_text())};
  if (shots.empty()) {
    design::NearFieldOptions how;
    how.shots = options.shots;
    how.noise = noise;
    how.seed = options.seed;
    shots = choose_shots(context.console, basis, importance, setup, how, context.stop);
    say_if_stopped(context, comments);
  }
  comments.push_back(
      fmt::format("centres of {} near-field shots, field of view {:g} deg, camera {:g} mm, {} "
                  "lamp; weights {}; basis {}, seed {}",
                  shots.size(), options.camera.fov_deg, options.camera.camera_mm,
                  options.camera.lamp_mm > 0.0 ? "near" : "directional", to_text(weights),
                  basis_fingerprint(basis).substr(0, 12), options.seed));
  files::write_text_file(options.out, directions_text(shots, comments), overwrite(options.force));
  context.console.result(near_field_text(basis, importance, shots, setup, noise));
  context.console.say(fmt::format("{}: {} shots", options.out, shots.size()));
  return kSuccess;
}

int plan(Context& context, const PlanOptions& options) {
  check_plan_options(options);
  if (options.near_field) return plan_near_field(context, options);
  const bool from_list = !options.directions.empty();
  const DesignRequest request = design_request(options);
  require_output(options.out, options.force,
                 {options.basis, options.directions, options.rig, options.calibration});

  std::optional<KnownRig> rig;
  std::optional<rig::Inverse> inverse;
  if (!options.rig.empty()) {
    rig = known_rig(options.rig, options.calibration);
    inverse.emplace(rig->constants.rig, rig->file.branches);
  }
  const KnownRig* const known = rig ? &*rig : nullptr;
  const PoseRequest poses = pose_request(options, known);
  std::vector<samples::Direction> directions;
  if (from_list) directions = directions_input(options.directions, samples::BelowHorizon::Refuse);
  std::optional<basis::Basis> basis;
  if (!options.basis.empty()) basis = read_basis(context.console, options.basis);
  context.check_stop();
  if (known == nullptr && options.patch == "auto" && options.samples > 0 &&
      !poses.patch.is_point()) {
    context.console.say(fmt::format(
        "no rig: {} assumed, {:g} mm from the camera and {:g} mm from the lamp",
        to_text(poses.patch), poses.patch.camera_distance_mm, poses.patch.lamp_distance_mm));
  }
  const design::ImportanceBlend weights =
      request.weights.value_or(poses.patch.is_point() ? design::ImportanceBlend::for_points()
                                                      : design::ImportanceBlend::for_patches());
  Eigen::MatrixXd importance;
  if (basis) importance = design::blended_importance(*basis, basis->left_vectors, weights);
  context.check_stop();
  std::vector<std::string> comments{fmt::format("gonio plan {}", version_text())};
  if (from_list) {
    comments.push_back("directions from " +
                       std::filesystem::path(options.directions).filename().string());
  } else {
    const rig::Inverse* reach = inverse ? &*inverse : nullptr;
    const std::vector<brdf::HalfDiff> chosen =
        poses.patch.is_point()
            ? choose_directions(context.console, *basis, known, reach, request, context.stop)
            : choose_poses(context.console, *basis, importance, reach, poses, context.stop);
    say_if_stopped(context, comments);
    for (const brdf::HalfDiff& angles : chosen) directions.push_back({angles, 0});
    const bool published = request.method != DesignMethod::exchange;
    comments.push_back(fmt::format(
        "{} directions by {}, {}, objective {}, weights {}, for basis {} ({} materials), seed {}",
        options.samples, options.method, to_text(poses.patch),
        published ? "as published" : objective_text(request, poses.patch.is_point()),
        published ? "none" : to_text(weights), basis_fingerprint(*basis).substr(0, 12),
        basis->materials.size(), options.seed));
  }
  nlohmann::ordered_json explained = nlohmann::ordered_json::object();
  if (options.explain && basis) {
    const std::vector<brdf::HalfDiff> angles = angles_of(directions);
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
    files::write_text_file(options.out, directions_text(angles_of(directions), comments),
                           overwrite(options.force));
    if (options.json) context.console.result(json_text(explained));
    context.console.say(fmt::format("{}: {} directions", options.out, directions.size()));
    return kSuccess;
  }
  const rig::RigDescription& kinematics = rig->constants.rig;
  acquisition::MeasurementPlan session = plan_poses(rig->file, *inverse, directions, options.seed);
  refuse_unreachable(context.console, options.directions, session, options.skip_unreachable);
  std::vector<double> exposures_us;
  if (basis) {
    const basis::BasisRows rows(*basis);
    for (const auto& point : session.points) {
      exposures_us.push_back(expected_exposure_us(rig->file, rows, point.direction));
    }
  }
  const std::string duration = foresee(context.console, *rig, exposures_us, session);
  comments.push_back(fmt::format("rig {}, constants {}, travel {:.1f} s, session {}",
                                 kinematics.name, rig->constants.id, session.travel_s, duration));
  files::write_text_file(options.out, plan_text(kinematics, session, exposures_us, comments),
                         overwrite(options.force));
  if (options.json) {
    explained["session"] = session_json(session);
    context.console.result(json_text(explained));
  } else if (options.explain) {
    context.console.result(session_text(session, duration));
  }
  context.console.say(
      fmt::format("{}: {} directions, {}", options.out, session.points.size(), duration));
  return kSuccess;
}

}  // namespace

void add_plan(const Command& root) {
  auto options = std::make_shared<PlanOptions>();
  const Command command =
      root.add("plan", "Choose directions, or order given ones, for a rig",
               "gonio plan --basis basis.h5 --samples 10 --rig rigs/simulated.toml --out plan.csv");
  add_plan_options(command, *options);
  command.on_call(options, plan);
}

}  // namespace gonio::cli
