#pragma once

#include <chrono>
#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <stop_token>
#include <string>

#include "gonio/devices/frame.h"
#include "gonio/monitor/http_server.h"

namespace gonio::monitor {

/// The newest frame of a camera that somebody sets up, on its way from the thread that takes it to
/// the page.
///
/// Threads  All members may be called from any.
class SetupView {
 public:
  /// Waits until a page has asked for a frame since the last one was shown. False: `stop`.
  bool wait_until_asked(std::stop_token stop);
  void show(devices::Frame frame);
  /// What went wrong with the last one instead; the older frame stays.
  void show_error(const std::string& text);

  struct Shown {
    std::shared_ptr<const devices::Frame> frame;  ///< null: none yet
    std::uint64_t number = 0;                     ///< counts up with every frame
    std::string error;                            ///< may be empty
  };
  /// Asks for a newer one as well.
  Shown newest();

 private:
  std::mutex mutex_;
  std::condition_variable_any asked_for_;
  bool asked_ = false;
  Shown shown_;
};

/// The page for focusing and aiming a camera: live image, crosshair, a region to draw, its
/// histogram and how sharp it is.
///
///   GET /            the page, and its files
///   GET /setup.json?column=..&row=..&width=..&height=..
///                    number, figures and focus (focus_of()) of the newest frame in that region, px
///   GET /frame.png   the newest frame; 404: none yet
///
/// State    Serves from construction to destruction; `view` must outlive it.
/// Errors   As HttpServer.
class SetupPage {
 public:
  /// `title` names rig, channel and exposure.
  SetupPage(const HttpAddress& address, SetupView& view, std::string title);
  ~SetupPage();
  SetupPage(const SetupPage&) = delete;
  SetupPage& operator=(const SetupPage&) = delete;

  std::string url() const;
  std::uint16_t port() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace gonio::monitor
