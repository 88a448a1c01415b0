#include "gonio/monitor/setup_page.h"

#include <algorithm>
#include <charconv>

#include "gonio/devices/clock.h"
#include "page_parts.h"

namespace gonio::monitor {
namespace {

int pixels(const HttpRequest& request, const char* name) {
  const auto found = request.query.find(name);
  if (found == request.query.end()) return 0;
  int number = 0;
  const char* const last = found->second.data() + found->second.size();
  const auto [end, error] = std::from_chars(found->second.data(), last, number);
  return error == std::errc() && end == last ? number : 0;
}

}  // namespace

bool SetupView::wait_until_asked(std::stop_token stop) {
  std::unique_lock lock(mutex_);
  return asked_for_.wait(lock, std::move(stop), [&] { return asked_; });
}

void SetupView::show(devices::Frame frame) {
  auto shared = std::make_shared<const devices::Frame>(std::move(frame));
  const std::lock_guard lock(mutex_);
  shown_ = {std::move(shared), shown_.number + 1, ""};
  asked_ = false;
}

void SetupView::show_error(const std::string& text) {
  const std::lock_guard lock(mutex_);
  shown_.error = text;
  asked_ = false;
}

SetupView::Shown SetupView::newest() {
  const std::lock_guard lock(mutex_);
  asked_ = true;
  asked_for_.notify_all();
  return shown_;
}

struct SetupPage::State {
  State(const HttpAddress& address, SetupView& from, std::string name)
      : view(from),
        title(std::move(name)),
        server(address, [this](const HttpRequest& request) { return reply(request); }) {}

  HttpReply reply(const HttpRequest& request) {
    if (request.method != "GET") return {405, "text/plain; charset=utf-8", "expected GET\n"};
    if (request.path == "/setup.json") return json_reply(state(request));
    if (request.path == "/frame.png") {
      const SetupView::Shown newest = view.newest();
      return newest.frame ? png_reply(shown.view(newest.frame)->png) : not_found();
    }
    return page_file(request.path == "/" ? "/setup.html" : request.path).value_or(not_found());
  }

  nlohmann::ordered_json state(const HttpRequest& request) const {
    const SetupView::Shown newest = view.newest();
    nlohmann::ordered_json state = {
        {"title", title}, {"number", newest.number}, {"error", newest.error}};
    if (!newest.frame) return state;
    const devices::Frame& frame = *newest.frame;
    const Region region = clipped({pixels(request, "column"), pixels(request, "row"),
                                   pixels(request, "width"), pixels(request, "height")},
                                  frame);
    state["width_px"] = frame.width_px;
    state["height_px"] = frame.height_px;
    state["exposure_ms"] = devices::to_seconds(frame.exposure) * 1e3;
    state["saturation_level_dn"] = frame.saturation_level_dn;
    state["region_px"] = {{"column", region.column},
                          {"row", region.row},
                          {"width", region.width_px},
                          {"height", region.height_px}};
    state["figures"] = figures_json(figures_of(frame, region));
    state["focus"] = focus_of(frame, region);
    return state;
  }

  SetupView& view;
  std::string title;
  ShownFrame shown;   ///< the server's thread only
  HttpServer server;  ///< last: ends before what it uses
};

SetupPage::SetupPage(const HttpAddress& address, SetupView& view, std::string title)
    : state_(std::make_unique<State>(address, view, std::move(title))) {}

SetupPage::~SetupPage() = default;

std::string SetupPage::url() const { return state_->server.url(); }
std::uint16_t SetupPage::port() const { return state_->server.port(); }

}  // namespace gonio::monitor
