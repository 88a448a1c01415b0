#include <fmt/format.h>

#include <set>

#include "command.h"
#include "outputs.h"
#include "report_data.h"
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

/// What a session lacks that did not come to its end; empty: it did.
std::string unfinished_text(const StoredSession& session) {
  if (session.archive.finished()) return "";
  return session.archive.folder().string() +
         ": the session did not come to its end: points may be missing, and where no white closes "
         "it, what the lamp did since the last one is not known";
}

int reduce(Context& context, const ReduceOptions& options) {
  require_output(options.out, options.force, {options.calibration});
  const StoredSession session = open_session(options.session, options.calibration);
  acquisition::ReductionOptions how = session.rig.reduction;
  if (options.grid > 0) how.grid = options.grid;
  acquisition::Reduction reduction = [&] {
    const PhaseTimer timer(context.console, "reducing");
    return reduce_session(session, how);
  }();
  for (const std::string& warning : reduction.warnings) context.console.warn(warning);
  for (const acquisition::PartBridge& bridge : reduction.bridges) {
    // Others are among the warnings.
    if (!bridge.is_applied() && !bridge.is_refused()) context.console.say(to_text(bridge));
  }
  if (!reduction.pairs.empty()) context.console.say(to_text(reduction.pairs));
  if (const std::string text = unfinished_text(session); !text.empty()) context.console.warn(text);
  context.check_stop();
  std::set<int> poses;
  for (const samples::Sample& sample : reduction.samples.samples) poses.insert(sample.pose);
  samples::write_samples(options.out, reduction.samples, overwrite(options.force));
  context.console.say(
      fmt::format("{}: {} samples of {} poses; white drift {}", options.out,
                  reduction.samples.samples.size(), poses.size(),
                  reduction.white_drift_relative
                      ? fmt::format("{:+.2f} %", 100.0 * *reduction.white_drift_relative)
                      : std::string("not known: there is but one white")));
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
