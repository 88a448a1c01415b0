#include <fmt/format.h>
#include <fmt/ranges.h>
#include <algorithm>
#include <map>
#include <optional>
#include <tuple>

#include "calibration_run.h"
#include "command.h"
#include "directions_input.h"
#include "dry_run.h"
#include "gonio/brdf/diffuse_models.h"
#include "gonio/errors/errors.h"
#include "gonio/files/sha256.h"
#include "gonio/files/text_file.h"
#include "gonio/instrument/alignment.h"
#include "gonio/instrument/calibration_file.h"
#include "gonio/setup/simulated_rig.h"
#include "json_text.h"
#include "plan_file.h"
#include "planning.h"
#include "session_end.h"

namespace gonio::cli {
namespace {

constexpr int kAsTheRigFileSays = -1;
constexpr int kMaxPointsUnset = 0;
constexpr double kLargestWish_db = 100.0;

struct MeasureOptions {
  std::string rig;
  std::string plan;
  std::string out;
  std::string calibration;
  std::string alignment;
  bool accept_calibration = false;
  bool accept_unaligned = false;
  std::string material;
  std::string expect;
  SessionLabels labels;
  int sentinel_every = kAsTheRigFileSays;
  int repeat_pairs = kAsTheRigFileSays;
  int reciprocity_pairs = kAsTheRigFileSays;
  std::optional<std::uint64_t> seed;
  bool dry_run = false;
  bool json = false;
  bool skip_unreachable = false;
  bool yes = false;
  bool simulate = false;
  std::optional<double> until_db;
  int max_points = kMaxPointsUnset;
  MonitorOptions watching;
};

/// What lies on the rig, as far as the program has to know.
void set_sample(SessionSetup& session, const MeasureOptions& options) {
  session.simulated = options.simulate || session.rig.driver == RigFile::Driver::simulated;
  if (!session.simulated) {
    if (!options.material.empty()) {
      throw UsageError("--material: what lies on a rig of metal cannot be chosen here",
                       "--simulate runs the session in a simulated world instead");
    }
    if (options.seed) {
      throw UsageError("--seed: a rig of metal has no world to draw",
                       "--simulate runs the session in a simulated world instead");
    }
    if (options.yes && session.rig.session.white == acquisition::WhitePlacement::manual) {
      throw UsageError("--yes: nobody would mount the white reference",
                       "leave it out, or measure a white in the frame (white.placement)");
    }
    // Only its geometry is looked at, by the check before anything is opened.
    session.material = {std::make_shared<brdf::Lambertian>(brdf::Rgb::Constant(0.5)),
                        brdf::RadiometricScale::si};
    return;
  }
  const std::string material = options.material.empty() ? session.rig.material : options.material;
  if (material.empty()) {
    throw UsageError("nothing lies on the simulated rig",
                     "give --material FILE or --material builtin:NAME");
  }
  const NamedMaterial named = named_material(material);
  session.material = load_sample(named);
  session.material_name = named.name;
  session.material_source = named.builtin != nullptr
                                ? "builtin:" + named.name
                                : std::filesystem::absolute(named.path).lexically_normal().string();
}

/// Puts the sample's frame where `gonio align` has found it. A calibration knows the datum only: a
/// sample on it leans by more than all of its angles are uncertain by, so that it has to be
/// aligned.
void align_sample(SessionSetup& session, const MeasureOptions& options) {
  if (options.alignment.empty()) {
    if (!session.calibration) return;  // the rig file says how far a sample may lean
    if (!options.accept_unaligned) {
      throw UsageError(
          "nobody has looked how the sample lies on the calibrated rig",
          "gonio align finds it, then --alignment FILE; --accept-unaligned goes on all the same, "
          "and the session says so");
    }
    const Angle as_mounted = nominal_instrument(session.rig).u_normal;
    session.instrument.u_normal = std::max(session.instrument.u_normal, as_mounted);
    session.alignment["alignment"] = "none, accepted";
    return;
  }
  const instrument::Alignment alignment = instrument::read_alignment(options.alignment);
  const std::string sha256 = files::sha256_of_bytes(instrument::to_json(session.instrument));
  if (alignment.instrument_sha256 != sha256 && !options.accept_calibration) {
    throw UsageError(fmt::format("{}: was made with other constants ({:.8}) than this session's "
                                 "({:.8})",
                                 options.alignment, alignment.instrument_sha256, sha256),
                     "align again, or --accept-calibration to use it all the same");
  }
  const std::string despite = fmt::format(
      "{}",
      fmt::join(instrument::reasons_against(alignment, options.labels.sample_id, now_utc()), "; "));
  if (!despite.empty() && !options.accept_unaligned) {
    throw UsageError(options.alignment + ": " + despite,
                     "align again; --accept-unaligned goes on all the same, and the session says "
                     "so");
  }
  const Angle as_mounted = nominal_instrument(session.rig).u_normal;
  session.instrument = instrument::aligned(session.instrument, alignment);
  session.alignment = alignment_metadata(alignment);
  if (!despite.empty()) {
    session.instrument.u_normal = std::max(session.instrument.u_normal, as_mounted);
    session.alignment["alignment_accepted_despite"] = despite;
  }
}

/// What the sample is said to be like, for the forecast of a session.
void set_expected(SessionSetup& session, const MeasureOptions& options) {
  if (options.expect.empty()) return;
  const NamedMaterial named = named_material(options.expect);
  session.expected = load_sample(named);
  session.expected_name = named.name;
}

/// Points in their order, and what is left out.
void set_plan(SessionSetup& session, const MeasureOptions& options, const Console& console) {
  const rig::RigDescription& kinematics = session.instrument.rig;
  const bool is_file = std::filesystem::exists(options.plan);
  // A plan's joints are for a sample that lies straight: an aligned one is gone to by its
  // directions.
  if (options.alignment.empty() && is_file && has_poses(options.plan, kinematics)) {
    session.plan = read_poses(options.plan, kinematics);
    session.plan.duration_s += overhead_seconds(session.rig);
    session.exposures_us = planned_exposures_us(options.plan);
  } else {
    const rig::Inverse inverse(kinematics, session.rig.branches);
    session.plan = plan_poses(session.rig, inverse,
                              directions_input(options.plan, samples::BelowHorizon::Keep), 1);
    session.skipped = std::move(session.plan.refused);
    session.plan.refused.clear();
    session.skip_unreachable = options.skip_unreachable;
    // A dry run lists them all, the refusal with them.
    if (!options.dry_run) {
      acquisition::MeasurementPlan left{session.plan.points, session.skipped};
      refuse_unreachable(console, options.plan, left, options.skip_unreachable);
    }
  }
  session.plan_text = is_file ? files::read_text_file(options.plan)
                              : plan_text(kinematics, session.plan, {}, {options.plan});
}

/// The second halves of pairs, with the exposures of the first.
void add_pairs(SessionSetup& session, const Console& console) {
  const acquisition::PairOptions& pairs = session.rig.pairs;
  if (pairs.repeats == 0 && pairs.reciprocals == 0) return;
  // Camera and lamp can only change places where the rig has poses for it, whatever it is planned
  // on.
  rig::BranchSet branches = session.rig.branches;
  branches.reciprocal = true;
  const rig::Inverse inverse(session.instrument.rig, branches);
  const std::size_t alone = session.plan.points.size();
  session.plan = acquisition::with_pairs(inverse, session.plan, pairs);
  const std::size_t found = session.plan.points.size() - alone;
  const auto wanted = static_cast<std::size_t>(pairs.repeats + pairs.reciprocals);
  if (found < wanted) {
    console.warn(fmt::format("{} pairs were asked for, {} points have a place and a pose for one",
                             wanted, found));
  }
  if (session.exposures_us.empty()) return;
  std::vector<double> exposures_us;
  std::map<std::tuple<double, double, double>, double> by_direction;
  auto next = session.exposures_us.begin();
  for (const acquisition::PlannedPoint& point : session.plan.points) {
    const brdf::HalfDiff& d = point.direction;
    double& exposure = by_direction[{d.theta_h.radians(), d.theta_d.radians(), d.phi_d.radians()}];
    if (!point.again) exposure = *next++;
    exposures_us.push_back(exposure);
  }
  session.exposures_us = std::move(exposures_us);
}

/// The closed loop, which --basis turns on. What lies on the rig is known.
void set_loop(SessionSetup& session, const MeasureOptions& options) {
  const std::string& basis = options.watching.basis;
  if (basis.empty()) {
    if (options.until_db) throw UsageError("--until needs --basis");
    if (options.max_points != kMaxPointsUnset) throw UsageError("--max-points needs --basis");
    return;
  }
  session.loop = loop_settings(
      basis, options.until_db,
      options.max_points == kMaxPointsUnset ? LoopSettings().max_points : options.max_points,
      session.material.scale);
}

/// Says all that would be done and does nothing. Throws UsageError for what would be refused.
int dry_run(const Context& context, const SessionSetup& session, bool json) {
  const SessionPreflight preflight = preflight_session(session);
  context.console.result(json ? json_text(dry_run_json(session, preflight))
                              : dry_run_text(session, preflight));
  if (const acquisition::Check* refusal = preflight.found.refusal()) {
    throw UsageError(refusal->text);
  }
  std::string loop;
  if (session.loop) {
    loop = fmt::format(
        "; the closed loop may {}go on to {} points",
        session.loop->until_db ? "stop before, or " : "",
        std::max(static_cast<std::size_t>(session.loop->max_points), session.plan.points.size()));
  }
  context.console.say(fmt::format("{} direction(s) on {}, about {}{}; nothing was moved",
                                  session.plan.points.size(), session.instrument.rig.name,
                                  duration_text(preflight.found.forecast->total_s.expected), loop));
  return kSuccess;
}

int measure(Context& context, const MeasureOptions& options) {
  const Console& console = context.console;
  if (options.json && !options.dry_run) throw UsageError("--json: goes with --dry-run");
  if (options.out.empty() && !options.dry_run) throw UsageError("--out is required, or --dry-run");
  if (!options.out.empty()) {
    if (std::filesystem::exists(options.out)) {
      throw UsageError(options.out + ": cannot create: it exists",
                       "choose another name: a session is never replaced");
    }
    files::require_creatable(options.out);
  }
  SessionSetup session;
  session.rig = read_rig_file(options.rig);
  const auto set = [](int option, int& value) {
    if (option != kAsTheRigFileSays) value = option;
  };
  set(options.sentinel_every, session.rig.session.sentinel_every);
  set(options.repeat_pairs, session.rig.pairs.repeats);
  set(options.reciprocity_pairs, session.rig.pairs.reciprocals);
  session.instrument = instrument_of(session.rig, options.calibration);
  session.calibration = session_calibration(session.rig, options.calibration);
  session.accept_calibration = options.accept_calibration;
  try {
    align_sample(session, options);
  } catch (const UsageError& error) {
    if (!options.dry_run) throw;
    session.alignment_refusal = error.what();
  }
  set_plan(session, options, console);
  add_pairs(session, console);
  set_expected(session, options);
  set_sample(session, options);
  set_loop(session, options);
  session.seed = options.seed.value_or(session.seed);
  session.labels = options.labels;
  if (session.labels.sample_id.empty()) session.labels.sample_id = session.material_name;
  session.archive = options.out;
  session.ask_person = !options.yes;

  if (options.dry_run) return dry_run(context, session, options.json);
  MonitorOptions watching = options.watching;
  if (!watching.port) watching.basis.clear();  // it is the loop's alone
  return run_to_the_end(context, session, watching);
}

}  // namespace

void add_measure(const Command& root) {
  auto options = std::make_shared<MeasureOptions>();
  const Command command = root.add("measure", "Run a session",
                                   "gonio measure rigs/simulated.toml --plan plan.csv "
                                   "--material builtin:gold-satin --out session");
  command.text("RIG", options->rig, "Rig file", Need::required);
  command.text("--plan", options->plan, "Plan or list of directions (CSV)", Need::required);
  command.text("--out", options->out, "Session archive to create");
  command.flag("--dry-run", options->dry_run,
               "Check, show all that would be done and how long it takes; move nothing");
  command.flag("--json", options->json, "With --dry-run: as JSON");
  command.text("--expect", options->expect,
               "What the sample is like, for the time foreseen: a material file or builtin:NAME");
  command.text("--calibration", options->calibration, "Folder of a calibration, or constants");
  command.text("--alignment", options->alignment, "How the sample lies, from gonio align");
  command.flag("--accept-calibration", options->accept_calibration,
               "Go on with a calibration or alignment that would be refused");
  command.flag("--accept-unaligned", options->accept_unaligned,
               "Go on without knowing how the sample lies, or with an alignment that is old or "
               "another sample's");
  command.text("--material", options->material,
               "What lies on a simulated rig: a material file or builtin:NAME");
  command.label("--sample-id", options->labels.sample_id, "Stored with the session");
  command.label("--operator", options->labels.operator_name, "Stored with the session");
  command.label("--note", options->labels.note, "Stored with the session");
  command.seed(options->seed, "Of the simulated world (default 1)");
  command.flag("--skip-unreachable", options->skip_unreachable,
               "Leave out directions the rig cannot measure");
  command.integer("--sentinel-every", options->sentinel_every, 0, 100000,
                  "Points between checks of home marks and of the sentinel, a fixed pose on the "
                  "sample; 0: none (default: the rig file's)");
  command.integer("--repeat-pairs", options->repeat_pairs, 0, 1000,
                  "Points measured again half a session later (default: the rig file's)");
  command.integer(
      "--reciprocity-pairs", options->reciprocity_pairs, 0, 1000,
      "Points measured again with light and camera exchanged (default: the rig file's)");
  command.flag("--simulate", options->simulate,
               "Run in a simulated world although the rig file names devices");
  command.flag("--yes", options->yes, "Do not ask before going on");
  add_page_options(command, options->watching, "Serve a live page");
  command.text("--basis", options->watching.basis,
               "Close the loop with this basis: replace points that fail, add points where the "
               "material asks for them; a live page shows the reconstruction as it grows");
  command.positive("--until", options->until_db, kLargestWish_db,
                   "With --basis: stop when a picture of the result is expected at so many dB, and "
                   "go on behind the plan until then");
  command.integer("--max-points", options->max_points, 1, 100000,
                  "With --basis: points at most, those added included (default 40)");
  command.on_call(options, measure);
}

}  // namespace gonio::cli
