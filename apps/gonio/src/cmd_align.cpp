#include <fmt/format.h>

#include <cmath>

#include "command.h"
#include "find_alignment.h"
#include "gonio/calibration/result/step_refused.h"
#include "gonio/instrument/alignment.h"
#include "gonio/opened_rig/opened_rig.h"
#include "gonio/setup/simulated_rig.h"
#include "materials_input.h"
#include "outputs.h"
#include "session_calibration.h"

namespace gonio::cli {
namespace {

struct AlignOptions {
  std::string rig;
  std::string calibration;
  std::string out;
  std::string material;
  std::string sample;
  std::optional<double> seat_sigma_deg;
  std::optional<std::uint64_t> seed;
  bool accept_calibration = false;
  bool force = false;
};

/// A simulated rig with the material on it, or the one of metal.
std::unique_ptr<OpenedRig> open_with_sample(const Context& context, const RigFile& rig,
                                            const AlignOptions& options) {
  if (rig.driver == RigFile::Driver::hardware) {
    if (!options.material.empty()) {
      throw UsageError("--material: what lies on a rig of metal cannot be chosen here");
    }
    if (options.seed) throw UsageError("--seed: a rig of metal has no world to draw");
    return open_hardware_rig(rig, Parts::all, context.stop);
  }
  const std::string material = options.material.empty() ? rig.material : options.material;
  if (material.empty()) {
    throw UsageError("nothing lies on the simulated rig",
                     "give --material FILE or --material builtin:NAME");
  }
  return open_simulated_rig(
      simulated_world(rig, load_sample(named_material(material)).model, options.seed.value_or(1)));
}

void refuse_for_seat(const AlignOptions& options) {
  if (options.material.empty() && !options.seed) return;
  throw UsageError(
      fmt::format("--seat-sigma: nothing is looked at, {} says nothing then",
                  options.material.empty() ? "--seed" : "--material"),
      "leave one of them out: a glossy sample is aligned by its highlight, a matte one by its "
      "seat");
}

int align(Context& context, const AlignOptions& options) {
  const Console& console = context.console;
  if (options.seat_sigma_deg) refuse_for_seat(options);
  require_output(options.out, options.force, {options.rig, options.calibration});
  const KnownRig known = known_rig(options.rig, options.calibration);
  if (calibration_place(known.file, options.calibration).empty()) {
    console.warn(
        "without --calibration the rig's zeros are taken as its file says; what they are off by is "
        "in no uncertainty");
  }
  const AlignmentRig rig{known.file, known.constants,
                         !calibration_place(known.file, options.calibration).empty()};
  // As a session would ask, which takes its constants from there: before anything is opened, and
  // with the devices that are there.
  std::optional<SessionCalibration> used = session_calibration(known.file, options.calibration);
  const auto require_usable = [&] {
    if (used && !options.accept_calibration) used->require_usable();
  };
  require_usable();
  instrument::Alignment alignment;
  if (options.seat_sigma_deg) {
    alignment = alignment_by_seat(rig, Angle::from_degrees(*options.seat_sigma_deg));
    blame("--seat-sigma", [&] { alignment.validate(); });
  } else {
    const auto opened = open_with_sample(context, known.file, options);
    if (used) used->use.serials = serials_of(*opened);
    require_usable();
    try {
      alignment = alignment_by_highlight(console, rig, *opened, context.stop);
    } catch (const calibration::StepRefused& refused) {
      console.error(refused.what(),
                    "nothing was written; a sample without a highlight is aligned by its seat: "
                    "--seat-sigma DEG");
      return kDoNotTrust;
    }
    opened->require_safe();
  }
  alignment.sample = options.sample;
  instrument::write_alignment(options.out, alignment, overwrite(options.force));
  console.result(fmt::format(
      "tilt about x {:+.4f} +- {:.4f} deg, about y {:+.4f} +- {:.4f} deg ({})\n",
      alignment.tilt_x.degrees(),
      Angle::from_radians(std::sqrt(alignment.covariance(0, 0))).degrees(),
      alignment.tilt_y.degrees(),
      Angle::from_radians(std::sqrt(alignment.covariance(1, 1))).degrees(), alignment.method));
  return kSuccess;
}

}  // namespace

void add_align(const Command& root) {
  auto options = std::make_shared<AlignOptions>();
  const Command command =
      root.add("align", "Find how the mounted sample lies, from its own highlight",
               "gonio align rig.toml --calibration calibration --out alignment.json");
  command.text("RIG", options->rig, "Rig file", Need::required);
  command.text("--calibration", options->calibration,
               "Calibration of the rig: a folder or constants");
  command.text("--out", options->out, "Alignment to write (JSON), for measure --alignment",
               Need::required);
  command.label("--sample-id", options->sample, "Stored with the alignment");
  command.positive("--seat-sigma", options->seat_sigma_deg, 5.0,
                   "Of a matte sample that lies on the datum: how far its normal may lean, deg; "
                   "nothing is looked at");
  command.text("--material", options->material,
               "What lies on a simulated rig: a material file or builtin:NAME");
  command.seed(options->seed, "Of the simulated world (default 1)");
  command.flag("--accept-calibration", options->accept_calibration,
               "Go on with a calibration that would be refused");
  command.force(options->force);
  command.on_call(options, align);
}

}  // namespace gonio::cli
