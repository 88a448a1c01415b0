#include "plan_options.h"

#include <fmt/format.h>

#include <initializer_list>

#include "gonio/console/failures.h"

namespace gonio::cli {
namespace {

/// An option counts as given when its value is not the default: a default changes nothing.
struct Option {
  const char* name;
  bool given;
};

/// `why` completes the sentence "--noise ...".
void refuse(std::initializer_list<Option> options, const std::string& why) {
  for (const Option& option : options) {
    if (option.given) throw UsageError(fmt::format("{} {}", option.name, why));
  }
}

}  // namespace

void check_plan_options(const PlanOptions& options) {
  const PlanOptions defaults;
  const Option method{"--method", options.method != defaults.method};
  const Option objective{"--objective", options.objective != defaults.objective};
  const Option weights{"--weights", options.weights != defaults.weights};
  const Option patch{"--patch", options.patch != defaults.patch};
  const Option noise{"--noise", options.relative_noise().has_value()};
  const Option time_price{"--time-price", options.percent_per_second > 0.0};
  const Option calibration{"--calibration", !options.calibration.empty()};
  const Option skip{"--skip-unreachable", options.skip_unreachable};
  const Option shots{"--shots", options.shots != defaults.shots};
  const bool from_list = !options.directions.empty();

  if (options.near_field) {
    if (options.basis.empty() || options.samples > 0 || !options.rig.empty()) {
      throw UsageError("--near-field needs --basis, and --shots instead of --samples and --rig");
    }
    refuse({method,
            objective,
            patch,
            time_price,
            calibration,
            skip,
            {"--explain", options.explain},
            {"--json", options.json}},
           "does nothing with --near-field");
    if (from_list) refuse({shots}, "does nothing with --directions, which says how many");
    return;
  }
  refuse({shots}, "goes with --near-field only");
  refuse_near_field_options(options.camera, "--near-field");
  if (from_list == (options.samples > 0)) {
    throw UsageError("give either --samples with --basis to choose directions, or --directions");
  }
  if (!from_list && options.basis.empty()) throw UsageError("--samples needs --basis");
  if (options.json && !options.explain) throw UsageError("--json goes with --explain");
  if (options.rig.empty()) {
    if (time_price.given) throw UsageError("--time-price needs --rig: exposures depend on it");
    refuse({calibration, skip}, "goes with --rig");
  }
  const bool figures = options.explain && !options.basis.empty();
  if (from_list) {
    refuse({method, objective, time_price}, "chooses: it does nothing with --directions");
    if (!figures) {
      refuse({weights, noise, patch}, "goes with --samples, or with --explain and --basis");
    }
  } else if (method.given) {
    const std::string why = fmt::format("does nothing with --method {}", options.method);
    refuse({objective, time_price}, why);
    if (!figures) refuse({weights, noise}, why + ", but with --explain");
  }
  // Poses are chosen for patches by the expected error; other objectives and what was published
  // know points.
  const bool of_points = objective.given && options.objective != "a";
  if ((method.given || of_points || time_price.given) && patch.given && options.patch != "0") {
    throw UsageError(fmt::format(
        "--patch {} goes with --method exchange, --objective a or auto and no --time-price only",
        options.patch));
  }
}

void add_plan_options(const Command& command, PlanOptions& options) {
  command.text("--basis", options.basis, "Basis to choose for");
  command.integer("--samples", options.samples, 1, 1000, "How many directions to choose");
  command.text("--directions", options.directions,
               "Order these instead: a CSV file, or a published set such as nielsen-10");
  command.text("--rig", options.rig, "Rig file: only reachable directions, with poses and times");
  command.text("--calibration", options.calibration,
               "Instrument constants instead of those the rig file names");
  command.text("--out", options.out, "Plan to write (CSV)", Need::required);
  command.choice("--method", options.method, {"exchange", "nielsen", "xu"},
                 "How to search: over all directions, or as published in 2015 or 2016");
  command.choice(
      "--objective", options.objective, {"auto", "a", "d", "xu", "loo"},
      "What the exchange lowers: expected error (a), volume left open (d), Xu's metric, or "
      "the error of training materials left out (loo); auto: a, and loo after it for "
      "up to five points");
  command.text("--weights", options.weights,
               "Where errors matter: auto (by points or patches), uniform, solid-angle, image, or "
               "shares of them");
  command.number("--noise", options.noise, -1.0, 1.0,
                 "Relative standard deviation to plan for; below 0: what the rig's constants say");
  command.number("--time-price", options.percent_per_second, 0.0, 100.0,
                 "Per cent of the square error that a second of exposure is worth");
  command.text(
      "--patch", options.patch,
      "Choose poses for all that a frame shows: half width of the sample in mm, 0 for points, "
      "auto for the rig's own (25 without a rig)");
  command.flag("--near-field", options.near_field,
               "Choose centres of photographs taken from near, each pixel a direction");
  command.integer("--shots", options.shots, 1, 20, "How many, with --near-field");
  add_near_field_options(command, options.camera);
  command.seed(options.seed, "Of the search");
  command.flag("--explain", options.explain, "Print poses, times and figures of the design");
  command.flag("--json", options.json, "With --explain: as JSON");
  command.flag("--skip-unreachable", options.skip_unreachable,
               "Leave out listed directions the rig cannot measure");
  command.force(options.force);
}

}  // namespace gonio::cli
