#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>

#include "command.h"
#include "gonio/acquisition/decisions.h"
#include "gonio/acquisition/resume.h"
#include "gonio/acquisition/time_left.h"
#include "gonio/acquisition/trust_notes.h"
#include "gonio/console/printable.h"
#include "gonio/errors/errors.h"
#include "gonio/samples/csv.h"
#include "json_text.h"
#include "plan_file.h"
#include "planning.h"
#include "session_calibration.h"
#include "session_loop.h"
#include "session_preflight.h"
#include "session_run.h"
#include "stored_session.h"

namespace gonio::cli {
namespace {

struct StatusOptions {
  std::string session;
  bool replay = false;
  std::string basis;
  bool json = false;
};

/// What the line on the calibration says already.
bool in_calibration_text(const std::string& key) {
  return key == "calibration_folder" || key == "calibration_valid_until_utc" ||
         key == "calibration_open_steps";
}

const char* session_state(const acquisition::SessionReader& archive, bool has_writer) {
  if (archive.finished()) return "complete";
  if (has_writer) return "running";
  const auto& notes = archive.notes();
  return !notes.empty() && notes.back().kind == acquisition::kPausedNote ? "paused" : "interrupted";
}

/// With what can be done about it.
std::string session_state_text(const std::string& state, const std::filesystem::path& folder,
                               std::optional<pid_t> writer, bool damaged) {
  if (state == "running") return fmt::format("running, process {}", *writer);
  if (state == "complete") return state + (damaged ? ", but damaged since: see below" : "");
  return fmt::format("{}; gonio resume {} goes on with it", state, printable_line(folder.string()));
}

/// How many the plan has; sessions of earlier versions do not tell.
std::optional<std::size_t> planned_points(const acquisition::SessionReader& archive) {
  const auto poses = archive.configuration().find(kPosesText);
  if (poses == archive.configuration().end()) return std::nullopt;
  samples::CsvReader rows(archive.folder() / kPosesText, poses->second);
  std::size_t points = 0;
  while (rows.next()) ++points;
  return points;
}

/// What decisions of the closed loop made of the plan.
struct Changed {
  std::size_t added = 0;
  std::size_t dropped = 0;
};

Changed changed_by(const std::vector<acquisition::LoggedDecision>& decisions) {
  Changed changed;
  for (const acquisition::LoggedDecision& each : decisions) {
    changed.added += each.decision.added.size();
    changed.dropped += each.decision.dropped.size();
  }
  return changed;
}

/// The last frame; empty: there is none.
std::string latest_text(const acquisition::SessionReader& archive) {
  if (archive.frames().empty()) return "";
  const acquisition::FrameRecord& frame = archive.frames().back();
  return fmt::format("{} frame{}, {} after the session began", acquisition::to_string(frame.kind),
                     frame.point >= 0 ? fmt::format(" of point {}", frame.point) : std::string(),
                     duration_text(devices::to_seconds(frame.exposure_start)));
}

/// How the sentinel went from its first reading to the last, by channel; empty: fewer than two.
std::string sentinel_change_text(const acquisition::SessionReader& archive) {
  const std::vector<acquisition::SentinelVisit> visits = acquisition::sentinel_visits(archive);
  if (visits.size() < 2) return "";
  std::string text;
  for (const auto& [channel, first] : visits.front().reading) {
    const auto last = visits.back().reading.find(channel);
    if (last == visits.back().reading.end()) continue;
    text += fmt::format("{}{} {:+.2f} %", text.empty() ? "" : ", ", channel,
                        100.0 * (last->second.level_dn_per_s / first.level_dn_per_s - 1.0));
  }
  if (text.empty()) return "";
  return fmt::format("{} since the first of {} readings, over {}", text, visits.size(),
                     duration_text(devices::to_seconds(visits.back().at - visits.front().at)));
}

std::vector<std::string> reasons_of(const std::vector<acquisition::LoggedDecision>& decisions) {
  std::vector<std::string> reasons;
  for (const acquisition::LoggedDecision& each : decisions) {
    reasons.push_back(each.decision.reason);
  }
  return reasons;
}

/// Whether the archive gives the decisions that were made.
int replay(Context& context, const std::filesystem::path& folder, const std::string& basis) {
  const StoredSession stored = open_session(folder);
  const std::size_t count = acquisition::decisions(stored.archive).size();
  const std::string scale_word = metadata(stored.archive, "radiometric_scale");
  const brdf::RadiometricScale scale =
      blame(folder, [&] { return brdf::radiometric_scale_from_string(scale_word); });
  std::optional<LoopSettings> settings = stored_loop(stored.archive, scale, basis);
  if (!settings) throw UsageError(folder.string() + ": was measured without a loop");
  const auto poses = stored.archive.configuration().find(kPosesText);
  if (poses == stored.archive.configuration().end()) {
    throw UsageError(fmt::format("{}: configuration: found no {}", folder.string(), kPosesText));
  }
  const rig::RigDescription& rig = stored.instrument.rig;
  const SessionLoop loop(std::move(*settings), stored.instrument, stored.rig, folder, scale,
                         nullptr);
  const std::vector<std::string> differences = replay_decisions(
      loop, stored.archive, rig, stored_poses(poses->second, folder / kPosesText, rig));
  for (const std::string& difference : differences) {
    context.console.warn(printable_line(difference));
  }
  context.console.result(fmt::format("{} of {} decisions are what the archive gives\n",
                                     count - differences.size(), count));
  return differences.empty() ? kSuccess : kDoNotTrust;
}

std::vector<int> suspect_list(const std::map<int, std::string>& suspects) {
  std::vector<int> points;
  for (const auto& suspect : suspects) points.push_back(suspect.first);
  return points;
}

/// How the parts of a session that was resumed were bridged, in their order.
std::vector<std::string> bridge_texts(const acquisition::SessionReader& archive) {
  std::vector<std::string> texts;
  for (const acquisition::SessionNote& note : archive.notes()) {
    if (note.kind == acquisition::kBridgeNote || note.kind == acquisition::kUnbridgedNote) {
      texts.push_back(note.text);
    }
  }
  return texts;
}

/// The text of the last note of a kind; empty: none.
std::string last_note(const acquisition::SessionReader& archive, const std::string& kind) {
  std::string text;
  for (const acquisition::SessionNote& note : archive.notes()) {
    if (note.kind == kind) text = note.text;
  }
  return text;
}

/// Of a session that is being measured, from its latest row on, in seconds of its own clock.
/// Nothing where its archive does not tell enough: the rest of the status is worth having.
std::optional<double> remaining_s(const acquisition::SessionReader& archive) {
  try {
    const StoredSession stored = stored_session(archive);
    SessionSetup session = stored_setup(stored);
    try {
      set_stored_sample(archive, session);
    } catch (const std::runtime_error&) {
      // The file of the material is elsewhere now: it is foreseen as one that nobody knows.
    }
    add_decided_points(archive, acquisition::resume_state(archive), session);
    const SessionPreflight preflight = preflight_session(session);
    if (!preflight.found.itinerary) return std::nullopt;
    return acquisition::seconds_left(archive, *preflight.found.itinerary, session.plan);
  } catch (const std::runtime_error&) {
    return std::nullopt;
  }
}

int status(Context& context, const StatusOptions& options) {
  const std::filesystem::path folder(options.session);
  require_session(folder);
  if (options.replay) return replay(context, folder, options.basis);
  if (!options.basis.empty()) throw UsageError("--basis: goes with --replay");
  // Before it is read: one that ends meanwhile was being measured.
  const auto writer = files::lock_holder(acquisition::session_lock(folder));
  const acquisition::SessionReader archive(folder);
  const std::vector<acquisition::LoggedDecision> decisions = acquisition::decisions(archive);
  std::map<std::string, int> frames;
  for (const auto& frame : archive.frames()) {
    ++frames[std::string(acquisition::to_string(frame.kind))];
  }
  // A point that was measured again counts as it ended last.
  std::map<int, acquisition::PointOutcome> outcomes;
  for (const auto& point : archive.points()) outcomes[point.point] = point.outcome;
  const std::map<int, std::string> suspects = acquisition::suspect_points(archive);
  const auto measured = std::count_if(outcomes.begin(), outcomes.end(), [](const auto& point) {
    return point.second == acquisition::PointOutcome::Measured;
  });
  const auto planned = planned_points(archive);
  const Changed changed = changed_by(decisions);
  const std::size_t points = planned ? *planned + changed.added : outcomes.size();
  const char* state = session_state(archive, writer.has_value());
  const std::optional<double> left =
      writer && !archive.finished() ? remaining_s(archive) : std::nullopt;
  if (options.json) {
    nlohmann::ordered_json result = {
        {"state", state},
        {"points", points},
        {"measured", measured},
        {"added", changed.added},
        {"dropped", changed.dropped},
        {"latest", latest_text(archive)},
        {"sentinel", sentinel_change_text(archive)},
        {"frames", frames},
        {"damage", archive.damage()},
        {"metadata", archive.metadata()},
        {"duration_s", archive.finished()
                           ? nlohmann::ordered_json(devices::to_seconds(*archive.finished_at()))
                           : nlohmann::ordered_json()},
        {"suspects", suspect_list(suspects)},
        {"bridges", bridge_texts(archive)},
        {"home_delta", last_note(archive, acquisition::kHomeDeltaNote)},
        {"decisions", reasons_of(decisions)}};
    if (left) result["remaining_s"] = *left;
    context.console.result(json_text(result));
  } else {
    std::string text =
        fmt::format("state            {}\n",
                    session_state_text(state, folder, writer, !archive.damage().empty()));
    const auto count_of = [](std::size_t count, const char* what) {
      return count == 0 ? std::string() : fmt::format(", {} {}", count, what);
    };
    text += fmt::format("points           {}, {} measured{}{}{}; numbered from 0\n", points,
                        measured, count_of(suspects.size(), "suspect"),
                        count_of(changed.added, "added by decisions"),
                        count_of(changed.dropped, "left out by decisions"));
    if (const std::string latest = latest_text(archive); !latest.empty()) {
      text += fmt::format("latest           {}\n", latest);
    }
    if (archive.finished()) {
      text += fmt::format("duration         {} of session time, interruptions included\n",
                          duration_text(devices::to_seconds(*archive.finished_at())));
    }
    if (left) {
      text +=
          fmt::format("left             about {} of session time from {}, as foreseen\n",
                      duration_text(*left), archive.frames().empty() ? "its beginning" : "there");
    }
    if (const std::string change = sentinel_change_text(archive); !change.empty()) {
      text += fmt::format("sentinel         {}\n", printable_line(change));
    }
    for (const auto& [point, why] : suspects) {
      text += fmt::format("suspect          point {}: {}\n", point, printable_line(why));
    }
    for (const std::string& bridge : bridge_texts(archive)) {
      text += fmt::format("bridge           {}\n", printable_line(bridge));
    }
    for (const auto& [kind, count] : frames)
      text += fmt::format("frames           {:4} {}\n", count, kind);
    text +=
        fmt::format("calibration      {}\n", printable_line(calibration_text(archive.metadata())));
    for (const auto& [key, value] : archive.metadata()) {
      if (!value.empty() && !in_calibration_text(key))
        text += fmt::format("{:<24} {}\n", printable_line(key), printable_line(value));
    }
    std::map<int, std::size_t> last_rows;
    for (std::size_t i = 0; i < archive.points().size(); ++i) {
      last_rows[archive.points()[i].point] = i;
    }
    for (std::size_t i = 0; i < archive.points().size(); ++i) {
      const acquisition::PointRecord& point = archive.points()[i];
      text += fmt::format("point {:3}  {:<32} {}{}{}{}\n", point.point, to_text(point.commanded),
                          acquisition::to_string(point.outcome), point.note.empty() ? "" : ": ",
                          printable_line(point.note),
                          last_rows[point.point] == i ? "" : " (measured again since)");
    }
    for (const auto& each : decisions) {
      text += fmt::format("{:8.1f} s  decision: {}\n", devices::to_seconds(each.at),
                          printable_line(each.decision.reason));
    }
    for (const auto& note : archive.notes()) {
      if (note.kind == acquisition::kDecisionNote) continue;
      text += fmt::format("{:8.1f} s  {}: {}\n", devices::to_seconds(note.at),
                          printable_line(note.kind),
                          printable_line(acquisition::text_for_people(note)));
    }
    for (const std::string& damage : archive.damage())
      text += "damaged: " + printable_line(damage) + "\n";
    context.console.result(text);
  }
  return archive.finished() && archive.damage().empty() ? kSuccess : kIncompleteSession;
}

}  // namespace

void add_status(const Command& root) {
  auto options = std::make_shared<StatusOptions>();
  const Command command =
      root.add("status", "What a session archive holds", "gonio status session");
  command.text("SESSION", options->session, "Session archive", Need::required);
  command.flag("--json", options->json, "Print JSON");
  command.flag("--replay", options->replay,
               "Recompute every decision of the closed loop from what was known then, and compare");
  command.text("--basis", options->basis, "With --replay: where the session's basis is now");
  command.on_call(options, status);
}

}  // namespace gonio::cli
