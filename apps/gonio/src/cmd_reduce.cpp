#include <fmt/format.h>

#include "command.h"
#include "outputs.h"
#include "session_run.h"

namespace gonio::cli {
namespace {

struct ReduceOptions {
  std::string session;
  std::string out;
  std::string calibration;
  int grid = 0;
  bool force = false;
};

int reduce(Context& context, const ReduceOptions& options) {
  require_output(options.out, options.force, {options.calibration});
  const StoredSession session = open_session(options.session, options.calibration);
  acquisition::ReductionOptions how = session.rig.reduction;
  if (options.grid > 0) how.grid = options.grid;
  acquisition::Reduction reduction = [&] {
    const PhaseTimer timer(context.console, "reducing");
    return reduce_session(session, how);
  }();
  for (const std::string& damage : session.archive.damage()) context.console.warn(damage);
  for (const std::string& warning : reduction.warnings) context.console.warn(warning);
  for (const acquisition::PartBridge& bridge : reduction.bridges) {
    // Others are among the warnings.
    if (!bridge.is_applied() && !bridge.is_refused()) context.console.say(to_text(bridge));
  }
  context.check_stop();
  samples::write_samples(options.out, reduction.samples, overwrite(options.force));
  context.console.say(fmt::format("{}: {} samples of {} poses; white drift {:+.2f} %", options.out,
                                  reduction.samples.samples.size(), session.archive.points().size(),
                                  100.0 * reduction.white_drift_relative));
  return kSuccess;
}

}  // namespace

void add_reduce(const Command& root) {
  auto options = std::make_shared<ReduceOptions>();
  const Command command = root.add("reduce", "Turn a session's frames into BRDF samples",
                                   "gonio reduce session --out samples.csv");
  command.text("SESSION", options->session, "Session archive", Need::required);
  command.text("--out", options->out, "Samples to write (CSV)", Need::required);
  command.text("--calibration", options->calibration,
               "Instrument constants instead of those stored in the session");
  command.integer("--grid", options->grid, 1, 64, "Values per pose: GRID x GRID; 1: points");
  command.force(options->force);
  command.on_call(options, reduce);
}

}  // namespace gonio::cli
