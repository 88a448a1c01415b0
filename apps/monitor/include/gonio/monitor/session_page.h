#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <string>

#include "gonio/monitor/growing_reconstruction.h"
#include "gonio/monitor/http_server.h"
#include "gonio/monitor/page_token.h"
#include "gonio/monitor/session_monitor.h"

namespace gonio::monitor {

/// What a page may ask of a session, each from the server's thread.
struct SessionControls {
  std::function<void()> pause;
  std::function<void()> stop;
};

/// The live page of a session.
///
///   GET  /                  the page, and its /style.css, /session.js
///   GET  /state.json        progress, pose, lamp, notes, figures of the last frame
///   GET  /points.json?from  points told, from that one on
///   GET  /frame.png         the last frame; /sphere.png the reconstruction; 404: none yet
///   POST /pause, /stop      with the header X-Gonio-Token; 403 without the right one
///
/// State    Serves from construction to destruction. What is passed in must outlive it;
///          `reconstruction` may be null: no basis was given.
/// Errors   As HttpServer.
class SessionPage {
 public:
  SessionPage(const HttpAddress& address, SessionMonitor& monitor, SessionControls controls,
              GrowingReconstruction* reconstruction);
  ~SessionPage();
  SessionPage(const SessionPage&) = delete;
  SessionPage& operator=(const SessionPage&) = delete;

  /// Waits until a page that looks on has been told how the session ended; not at all when none has
  /// asked within the last `most`.
  void let_the_end_be_seen(std::chrono::milliseconds most) const;

  /// Without the token: whoever has this may look.
  std::string url() const;
  /// With it, behind a '#' where browsers keep it to themselves: may also pause and stop.
  std::string control_url() const;
  std::uint16_t port() const;
  const PageToken& token() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace gonio::monitor
