#include "session_end.h"

#include <fmt/format.h>

#include <functional>

#include "gonio/devices/device_error.h"
#include "gonio/errors/errors.h"

namespace gonio::cli {
namespace {

std::string how_to_go_on(const SessionSetup& session) {
  return fmt::format("gonio resume {} goes on with it", session.archive.string());
}

/// Why a session is not complete.
const char* why_incomplete(const acquisition::SessionResult& result, const std::stop_token& stop) {
  if (result.finished || !result.failed.empty()) return "incomplete";
  return stop.stop_requested() ? "stopped" : "paused";
}

/// A request that may come from a signal or from the page.
class Request {
 public:
  explicit Request(const std::stop_token& signal) : forward_(signal, [this] { request(); }) {}
  void request() { source_.request_stop(); }
  std::stop_token token() const { return source_.get_token(); }

 private:
  std::stop_source source_;
  std::stop_callback<std::function<void()>> forward_;
};

}  // namespace

int run_to_the_end(Context& context, const SessionSetup& session, const MonitorOptions& watching,
                   std::optional<SessionToResume> resumed) {
  const Console& console = context.console;
  const std::string archive = session.archive.string();
  Request stop(context.stop);
  Request pause(context.pause_on_interrupt());
  const std::stop_callback<std::function<void()>> tell(pause.token(), [&console] {
    console.say("pausing after this point or white; Ctrl-C once more stops at once");
  });
  const std::unique_ptr<LiveSession> live = live_session(
      console, watching, session, {[&pause] { pause.request(); }, [&stop] { stop.request(); }});
  const bool goes_on = resumed.has_value();
  acquisition::SessionResult result;
  try {
    result = run_session(console, session, stop.token(), pause.token(), std::move(resumed),
                         live ? &live->monitor() : nullptr);
  } catch (const files::HeldByAnother&) {
    throw;
  } catch (const acquisition::FolderMoved& error) {
    if (live) live->end("failed");
    console.error(error.what(), "gonio resume FOLDER, where it is now, goes on with it");
    return kIncompleteSession;
  } catch (const FileError& error) {
    // A disk that is full. Before there is an archive that is an error like any other.
    if (!std::filesystem::exists(session.archive)) throw;
    if (live) live->end("failed");
    console.error(error.what(), how_to_go_on(session));
    return kIncompleteSession;
  } catch (const devices::DeviceError&) {
    if (std::filesystem::exists(session.archive)) console.say(how_to_go_on(session));
    if (live) live->end("failed");
    throw;
  }
  if (live) live->end(result.complete ? "finished" : why_incomplete(result, stop.token()));
  for (const std::string& warning : result.warnings) console.warn(warning);
  console.say(fmt::format(
      "{}: {} of {} directions{} {} of session time", archive, result.measured, result.planned,
      goes_on ? fmt::format(", {} of them now; this part took", result.measured_now) : " in",
      duration_text(result.duration_s)));
  if (result.suspect > 0) {
    console.warn(
        fmt::format("{} of them are suspect by the session's own checks, also when they were taken "
                    "again: gonio status {} says why; mend that and measure their directions anew",
                    result.suspect, archive));
  }
  if (result.complete) return kSuccess;
  console.error(fmt::format("{}: {} after {} of {} directions{}", archive,
                            why_incomplete(result, stop.token()), result.measured, result.planned,
                            !result.finished && result.measured == result.planned
                                ? ", before it had come to its end"
                                : ""),
                result.finished ? "what was measured is in the archive and can be reduced"
                                : how_to_go_on(session));
  return kIncompleteSession;
}

}  // namespace gonio::cli
