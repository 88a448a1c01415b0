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
const char* why_incomplete(const acquisition::SessionResult& result, const Context& context) {
  if (result.finished) return "incomplete";
  return context.stop.stop_requested() ? "stopped" : "paused";
}

}  // namespace

int run_to_the_end(Context& context, const SessionSetup& session,
                   std::optional<SessionToResume> resumed) {
  const Console& console = context.console;
  const std::string archive = session.archive.string();
  const std::stop_token pause = context.pause_on_interrupt();
  const std::stop_callback<std::function<void()>> tell(
      pause, [&console] { console.say("pausing after this point; once more stops at once"); });
  acquisition::SessionResult result;
  try {
    result = run_session(console, session, context.stop, pause, std::move(resumed));
  } catch (const files::HeldByAnother&) {
    throw;
  } catch (const FileError& error) {
    // A disk that is full. Before there is an archive that is an error like any other.
    if (!std::filesystem::exists(session.archive)) throw;
    console.error(error.what(), how_to_go_on(session));
    return kIncompleteSession;
  } catch (const devices::DeviceError&) {
    if (std::filesystem::exists(session.archive)) console.say(how_to_go_on(session));
    throw;
  }
  for (const std::string& warning : result.warnings) console.warn(warning);
  console.say(fmt::format("{}: {} of {} directions in {} of session time", archive, result.measured,
                          session.plan.points.size(), duration_text(result.duration_s)));
  if (result.complete) return kSuccess;
  console.error(
      fmt::format("{}: {} after {} of {} directions", archive, why_incomplete(result, context),
                  result.measured, session.plan.points.size()),
      result.finished ? "what was measured is in the archive and can be reduced"
                      : how_to_go_on(session));
  return kIncompleteSession;
}

}  // namespace gonio::cli
