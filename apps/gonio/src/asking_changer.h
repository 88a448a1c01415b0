#pragma once

#include <functional>
#include <stop_token>
#include <string>
#include <utility>

#include "gonio/devices/target_changer.h"

namespace gonio::cli {

/// A person at the terminal, who changes the target, or lets the rig's own changer do it: that of
/// a simulated world or a motorised one.
///
/// State    What lies there at first counts as the sample.
/// Errors   DeviceError, Stopped: nobody confirmed, or a stop was asked for, which ends the waiting
///          at once.
class AskingChanger final : public devices::TargetChanger {
 public:
  /// `own`       The rig's own changer; null where it has none.
  /// `on_pause`  Called when `pause` ends the waiting: nothing is under way that could be finished,
  ///             so that it has to ask for the stop.
  AskingChanger(devices::TargetChanger* own, std::stop_token stop, std::stop_token pause = {},
                std::function<void()> on_pause = {})
      : own_(own),
        stop_(std::move(stop)),
        pause_(std::move(pause)),
        on_pause_(std::move(on_pause)) {}

  const std::string& name() const override { return name_; }
  devices::Target mounted() const override { return mounted_; }
  void mount(devices::Target target) override;

 private:
  devices::TargetChanger* own_;
  std::stop_token stop_;
  std::stop_token pause_;
  std::function<void()> on_pause_;
  devices::Target mounted_ = devices::Target::sample;
  std::string name_ = "operator";
};

}  // namespace gonio::cli
