#include <fmt/chrono.h>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <chrono>
#include <ctime>

#include "calibration_run.h"
#include "command.h"
#include "gonio/errors/errors.h"
#include "session_end.h"
#include "stored_session.h"

namespace gonio::cli {
namespace {

struct ResumeOptions {
  std::string session;
  double outage_s = 0.0;
  bool accept_old = false;
  bool yes = false;
  MonitorOptions watching;
};

/// Held from before the archive is read. Throws UsageError when a live process is measuring it.
files::ProcessLock lock_of(const std::filesystem::path& folder) {
  require_session(folder);
  try {
    return files::ProcessLock(acquisition::session_lock(folder));
  } catch (const files::HeldByAnother& error) {
    throw UsageError(fmt::format("{}: process {} is measuring it", folder.string(), error.holder()),
                     "gonio status says how far it is");
  }
}

/// From the session's last word until now, by the calendar; its clock began with the session.
std::chrono::nanoseconds outage_until_now(const acquisition::SessionReader& archive,
                                          std::chrono::nanoseconds last_time) {
  std::tm started{};
  const std::string text = metadata(archive, "provenance_started_utc");
  if (::strptime(text.c_str(), "%Y-%m-%dT%H:%M:%SZ", &started) == nullptr) {
    throw DataFormatError(archive.folder(), "metadata provenance_started_utc",
                          fmt::format("found {:?}, expected a time", text));
  }
  using std::chrono::nanoseconds;
  using std::chrono::seconds;
  // A clock that was set back must not set the session's back; of centuries, which are no number of
  // nanoseconds any more, it matters alone that they are too long.
  const seconds whole =
      std::clamp(seconds(std::time(nullptr) - ::timegm(&started)), seconds(0),
                 std::chrono::ceil<seconds>(acquisition::kLatestPart) + seconds(1));
  return std::max(nanoseconds(0), whole - last_time);
}

/// As SessionWriter::resume() would once devices are open.
void require_believable(const acquisition::SessionReader& archive,
                        std::chrono::nanoseconds begins_at) {
  if (begins_at <= acquisition::kLatestPart) return;
  throw UsageError(
      fmt::format("{}: was begun more than {} years ago by its journal, or by the clock of this "
                  "computer, which says {:%F}",
                  archive.folder().string(),
                  acquisition::kLatestPart / std::chrono::hours(24 * 365), now_utc()),
      "set the clock of this computer, then resume it");
}

void tell_what_is_left(const Console& console, const acquisition::SessionReader& archive,
                       const acquisition::ResumeState& state, std::size_t points) {
  for (const std::string& damage : archive.damage()) console.warn(damage);
  for (const std::string& again : state.again) console.warn(again + ", is measured again");
  const std::size_t left =
      acquisition::points_left(acquisition::part_to_resume(state), points).size();
  console.say(fmt::format("{}: {} of {} points are done; new darks and white, then {}",
                          archive.folder().string(), state.done.size(), points,
                          left > 0 ? "the rest" : "the closing white"));
}

/// What the session was begun with is looked at once more: it may have expired meanwhile. Returns
/// what is accepted all the same.
std::string require_fresh(const acquisition::SessionReader& archive, bool accept_old) {
  std::string against;
  try {
    against = fmt::format("{}", fmt::join(grown_old(archive.metadata(), now_utc()), "; "));
  } catch (const std::invalid_argument& error) {
    throw DataFormatError(archive.folder(), "metadata", error.what());
  }
  if (against.empty() || accept_old) return against;
  throw UsageError(archive.folder().string() + ": " + against,
                   "begin a new session with a new calibration or alignment; --accept-calibration "
                   "goes on all the same, and the session says so");
}

int resume(Context& context, const ResumeOptions& options) {
  const std::filesystem::path folder(options.session);
  files::ProcessLock lock = lock_of(folder);
  if (acquisition::SessionReader(folder).configuration().empty()) {
    throw UsageError(options.session + ": ended before it had begun: nothing was measured",
                     "remove the folder and begin anew");
  }
  const StoredSession stored = open_session(folder);
  acquisition::ResumeState state = acquisition::resume_state(stored.archive);
  if (state.finished && !stored.archive.damage().empty()) {
    for (const std::string& damage : stored.archive.damage()) context.console.warn(damage);
    context.console.error(
        options.session + ": is finished, and was damaged afterwards",
        "what was lost cannot be measured in it again; gonio reduce takes what is "
        "left, a new session measures the rest");
    return kIncompleteSession;
  }
  if (state.finished) {
    context.console.say(options.session + ": is finished, there is nothing left to measure");
    return kSuccess;
  }
  acquisition::require_of_instrument(stored.archive, stored.instrument);
  SessionSetup session = stored_setup(stored);
  set_stored_sample(stored.archive, session);
  session.loop = stored_loop(stored.archive, session.material.scale, options.watching.basis);
  session.ask_person = !options.yes;
  add_decided_points(stored.archive, state, session);
  const int points = static_cast<int>(session.plan.points.size());
  if (!state.done.empty() && state.done.rbegin()->first >= points) {
    throw DataFormatError(
        folder, "table points",
        fmt::format("found point {}, the plan has {}", state.done.rbegin()->first, points));
  }
  if (!session.simulated && options.outage_s > 0.0) {
    throw UsageError("--outage: how long a rig of metal was down is known");
  }
  const auto outage = session.simulated ? std::chrono::duration_cast<std::chrono::nanoseconds>(
                                              std::chrono::duration<double>(options.outage_s))
                                        : outage_until_now(stored.archive, state.may_begin_at);
  // First: by a clock that is decades ahead everything is too old.
  require_believable(stored.archive, state.may_begin_at + outage);
  std::string despite = require_fresh(stored.archive, options.accept_old);
  tell_what_is_left(context.console, stored.archive, state, session.plan.points.size());
  MonitorOptions watching = options.watching;
  if (session.loop && !watching.port) watching.basis.clear();  // it is the loop's alone
  return run_to_the_end(context, session, watching,
                        SessionToResume{std::move(state), stored.archive.metadata(),
                                        std::move(lock), outage, std::move(despite)});
}

}  // namespace

void add_resume(const Command& root) {
  auto options = std::make_shared<ResumeOptions>();
  const Command command =
      root.add("resume", "Go on with a session that was interrupted", "gonio resume session");
  command.text("SESSION", options->session, "Session archive", Need::required);
  command.number("--outage", options->outage_s, 0.0, 1e6,
                 "Seconds that passed meanwhile in a simulated world (default 0)");
  command.flag("--accept-calibration", options->accept_old,
               "Go on with a calibration or alignment that has become too old");
  command.flag("--yes", options->yes, "Do not ask before going on");
  add_page_options(command, options->watching, "Serve a live page");
  command.text("--basis", options->watching.basis,
               "Where the basis of a session with a closed loop is now; with --monitor: show the "
               "reconstruction as it grows");
  command.on_call(options, resume);
}

}  // namespace gonio::cli
