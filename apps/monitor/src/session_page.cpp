#include "gonio/monitor/session_page.h"

#include <charconv>
#include <condition_variable>
#include <map>
#include <mutex>

#include "gonio/acquisition/trust_notes.h"
#include "gonio/devices/clock.h"
#include "page_parts.h"

namespace gonio::monitor {
namespace {

constexpr std::size_t kPointsPerReply = 1000;
constexpr std::size_t kFramesKept = 4;  // that pages have been told of and may still ask for

std::size_t number_or_zero(const HttpRequest& request, const char* name) {
  const auto found = request.query.find(name);
  if (found == request.query.end()) return 0;
  std::size_t number = 0;
  const char* const last = found->second.data() + found->second.size();
  const auto [end, error] = std::from_chars(found->second.data(), last, number);
  return error == std::errc() && end == last ? number : 0;
}

nlohmann::ordered_json lamp_json(const SessionMonitor::Snapshot& now) {
  nlohmann::ordered_json lamp = nlohmann::ordered_json::object();
  for (const auto& [channel, readings] : now.lamp) {
    nlohmann::ordered_json at_s = nlohmann::ordered_json::array();
    nlohmann::ordered_json relative = nlohmann::ordered_json::array();
    for (const ThinnedSeries::Value& reading : readings) {
      at_s.push_back(reading.at_s);
      relative.push_back(reading.value / readings.front().value);
    }
    lamp[channel] = {{"at_s", std::move(at_s)}, {"relative_to_first", std::move(relative)}};
  }
  return lamp;
}

nlohmann::ordered_json notes_json(const SessionMonitor::Snapshot& now) {
  nlohmann::ordered_json notes = nlohmann::ordered_json::array();
  for (const acquisition::SessionNote& note : now.notes) {
    notes.push_back({{"at_s", devices::to_seconds(note.at)},
                     {"kind", note.kind},
                     {"text", acquisition::text_for_people(note)}});
  }
  return notes;
}

std::string phase_of(const SessionMonitor::Snapshot& now) {
  if (!now.ended.empty()) return now.ended;
  if (now.wish == SessionMonitor::Wish::stop) return "stopping";
  if (now.wish == SessionMonitor::Wish::pause) return "pausing";
  return now.progress.phase;
}

}  // namespace

struct SessionPage::State {
  State(const HttpAddress& address, SessionMonitor& from, SessionControls what,
        GrowingReconstruction* made)
      : monitor(from),
        controls(std::move(what)),
        reconstruction(made),
        server(address, [this](const HttpRequest& request) { return reply(request); }) {}

  HttpReply reply(const HttpRequest& request) {
    if (request.path == "/pause") {
      return controlled(request, token, [this] {
        monitor.asked_to(SessionMonitor::Wish::pause);
        controls.pause();
      });
    }
    if (request.path == "/stop") {
      return controlled(request, token, [this] {
        monitor.asked_to(SessionMonitor::Wish::stop);
        controls.stop();
      });
    }
    if (request.method != "GET") return {405, "text/plain; charset=utf-8", "expected GET\n"};
    if (request.path == "/state.json") return json_reply(state());
    if (request.path == "/points.json") return json_reply(points(request));
    if (request.path == "/frame.png") return picture(request);
    if (request.path == "/sphere.png") {
      const auto picture = sphere();
      return picture && !picture->png.empty() ? png_reply(picture->png) : not_found();
    }
    return page_file(request.path == "/" ? "/session.html" : request.path).value_or(not_found());
  }

  void saw(const SessionMonitor::Snapshot& now) {
    const std::lock_guard lock(mutex);
    last_look = std::chrono::steady_clock::now();
    if (now.ended.empty()) return;
    end_was_seen = true;
    seen.notify_all();
  }

  std::shared_ptr<const GrowingReconstruction::Picture> sphere() {
    if (reconstruction == nullptr) return nullptr;
    return reconstruction->picture(monitor.snapshot().measured);
  }

  nlohmann::ordered_json state() {
    const SessionMonitor::Snapshot now = monitor.snapshot();
    const SessionFacts& facts = monitor.facts();
    saw(now);
    const acquisition::SessionProgress progress =
        SessionMonitor::counted_on(now, std::chrono::steady_clock::now());
    nlohmann::ordered_json state = {
        {"archive", facts.archive},
        {"rig", facts.rig},
        {"sample_id", facts.sample_id},
        {"simulated", facts.simulated},
        {"phase", phase_of(now)},
        {"is_over", !now.ended.empty()},
        {"points_done", now.progress.done},
        {"points_total", now.progress.total},
        {"points_told", now.points_told},
        {"measured", now.measured},
        {"not_measured", now.not_measured},
        {"frames", now.frames},
        {"elapsed_s", progress.elapsed_s},
        {"remaining_s", progress.remaining_s},
        {"time_scale", now.time_scale ? nlohmann::ordered_json(*now.time_scale) : nullptr},
        {"pose", pose_json(monitor.instrument().rig, now.joints)},
        {"lamp", lamp_json(now)},
        {"notes", notes_json(now)},
        {"notes_told", now.notes_told},
        {"frame", frame()},
        {"reconstruction", reconstruction_state(now.measured)}};
    if (!progress.point) return state;
    state["point"] = *progress.point;
    // Those that decisions have added are not among them.
    const auto under_way = static_cast<std::size_t>(*progress.point);
    if (under_way < facts.directions.size()) {
      const brdf::HalfDiff& direction = facts.directions[under_way];
      state["direction"] = {{"theta_h_deg", direction.theta_h.degrees()},
                            {"theta_d_deg", direction.theta_d.degrees()},
                            {"phi_d_deg", direction.phi_d.degrees()}};
    }
    return state;
  }

  /// The frame that a state has told of, ?n=ID, or the newest.
  HttpReply picture(const HttpRequest& request) {
    const auto known = told.find(static_cast<std::int64_t>(number_or_zero(request, "n")));
    if (known != told.end()) return png_reply(known->second->png);
    const auto held = monitor.frame();
    return held ? png_reply(shown.view(held->frame)->png) : not_found();
  }

  nlohmann::ordered_json frame() {
    const auto held = monitor.frame();
    if (!held) return nullptr;
    const acquisition::FrameRecord& record = held->record;
    const auto view = shown.view(held->frame);
    told.insert_or_assign(record.id, view);
    if (told.size() > kFramesKept) told.erase(told.begin());
    return {{"id", record.id},
            {"newest", held->newest},
            {"kind", to_string(record.kind)},
            {"point", record.point},
            {"channel", record.channel},
            {"exposure_ms", devices::to_seconds(record.exposure) * 1e3},
            {"at_s", devices::to_seconds(record.exposure_start)},
            {"width_px", held->frame->width_px},
            {"height_px", held->frame->height_px},
            {"saturation_level_dn", held->frame->saturation_level_dn},
            {"figures", figures_json(view->figures)}};
  }

  nlohmann::ordered_json reconstruction_state(int measured) {
    if (reconstruction == nullptr) {
      return {{"number", 0}, {"points", 0}, {"message", "no basis given (--basis FILE)"}};
    }
    const auto picture = reconstruction->picture(measured);
    return {
        {"number", picture->number}, {"points", picture->points}, {"message", picture->message}};
  }

  nlohmann::ordered_json points(const HttpRequest& request) const {
    const std::size_t from = number_or_zero(request, "from");
    nlohmann::ordered_json list = nlohmann::ordered_json::array();
    for (const SessionMonitor::Point& each : monitor.points(from, kPointsPerReply)) {
      nlohmann::ordered_json point = {{"point", each.point},
                                      {"outcome", to_string(each.outcome)},
                                      {"signal_over_white", each.signal_over_white},
                                      {"note", each.note}};
      const auto index = static_cast<std::size_t>(each.point);
      if (each.point >= 0 && index < monitor.facts().directions.size()) {
        const brdf::HalfDiff& direction = monitor.facts().directions[index];
        point["theta_h_deg"] = direction.theta_h.degrees();
        point["theta_d_deg"] = direction.theta_d.degrees();
        point["phi_d_deg"] = direction.phi_d.degrees();
      }
      list.push_back(std::move(point));
    }
    return {{"from", from}, {"points", std::move(list)}};
  }

  SessionMonitor& monitor;
  SessionControls controls;
  GrowingReconstruction* reconstruction;
  PageToken token;
  std::mutex mutex;
  std::condition_variable seen;
  std::optional<std::chrono::steady_clock::time_point> last_look;
  bool end_was_seen = false;
  ShownFrame shown;  ///< the server's thread only, as `told`
  std::map<std::int64_t, std::shared_ptr<const ShownFrame::View>> told;  ///< by the frame's id
  HttpServer server;  ///< last: ends before what it uses
};

SessionPage::SessionPage(const HttpAddress& address, SessionMonitor& monitor,
                         SessionControls controls, GrowingReconstruction* reconstruction)
    : state_(std::make_unique<State>(address, monitor, std::move(controls), reconstruction)) {}

SessionPage::~SessionPage() = default;

void SessionPage::let_the_end_be_seen(std::chrono::milliseconds most) const {
  std::unique_lock lock(state_->mutex);
  const auto now = std::chrono::steady_clock::now();
  if (!state_->last_look || now - *state_->last_look > most) return;  // nobody looks
  state_->seen.wait_until(lock, now + most, [&] { return state_->end_was_seen; });
}

std::string SessionPage::url() const { return state_->server.url(); }
std::string SessionPage::control_url() const { return url() + "#" + state_->token.text(); }
std::uint16_t SessionPage::port() const { return state_->server.port(); }
const PageToken& SessionPage::token() const { return state_->token; }

}  // namespace gonio::monitor
