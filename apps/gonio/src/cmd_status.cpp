#include <fmt/format.h>

#include <map>
#include <nlohmann/json.hpp>

#include "command.h"
#include "gonio/console/printable.h"
#include "json_text.h"
#include "planning.h"
#include "session_calibration.h"
#include "session_run.h"

namespace gonio::cli {
namespace {

struct StatusOptions {
  std::string session;
  bool json = false;
};

/// What the line on the calibration says already.
bool in_calibration_text(const std::string& key) {
  return key == "calibration_folder" || key == "calibration_valid_until_utc" ||
         key == "calibration_open_steps";
}

int status(Context& context, const StatusOptions& options) {
  const std::filesystem::path folder(options.session);
  if (!std::filesystem::exists(folder / "session.sqlite")) {
    throw UsageError(options.session + ": found no session.sqlite, expected a session archive");
  }
  const acquisition::SessionReader archive(folder);
  std::map<std::string, int> frames;
  for (const auto& frame : archive.frames()) {
    ++frames[std::string(acquisition::to_string(frame.kind))];
  }
  int measured = 0;
  for (const auto& point : archive.points()) {
    if (point.outcome == acquisition::PointOutcome::Measured) ++measured;
  }
  const char* state = archive.finished() ? "complete" : "interrupted";
  if (options.json) {
    const nlohmann::ordered_json result = {
        {"state", state},   {"points", archive.points().size()}, {"measured", measured},
        {"frames", frames}, {"damage", archive.damage()},        {"metadata", archive.metadata()}};
    context.console.result(json_text(result));
  } else {
    std::string text = fmt::format("state            {}\n", state);
    text += fmt::format("points           {}, {} measured\n", archive.points().size(), measured);
    for (const auto& [kind, count] : frames)
      text += fmt::format("frames           {:4} {}\n", count, kind);
    text +=
        fmt::format("calibration      {}\n", printable_line(calibration_text(archive.metadata())));
    for (const auto& [key, value] : archive.metadata()) {
      if (!value.empty() && !in_calibration_text(key))
        text += fmt::format("{:<24} {}\n", printable_line(key), printable_line(value));
    }
    for (const auto& point : archive.points()) {
      text += fmt::format("point {:3}  {:<32} {}{}{}\n", point.point, to_text(point.commanded),
                          acquisition::to_string(point.outcome), point.note.empty() ? "" : ": ",
                          printable_line(point.note));
    }
    for (const auto& note : archive.notes()) {
      text += fmt::format("{:8.1f} s  {}: {}\n", devices::to_seconds(note.at),
                          printable_line(note.kind), printable_line(note.text));
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
  command.on_call(options, status);
}

}  // namespace gonio::cli
