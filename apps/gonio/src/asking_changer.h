#pragma once

#include <string>

#include "gonio/devices/target_changer.h"

namespace gonio::cli {

/// A person at the terminal, who changes the target, or lets the rig's own changer do it: that of
/// a simulated world or a motorised one.
///
/// State    What lies there at first counts as the sample.
/// Errors   DeviceError, Stopped: nobody confirmed.
class AskingChanger final : public devices::TargetChanger {
 public:
  /// `own`  The rig's own changer; null where it has none.
  explicit AskingChanger(devices::TargetChanger* own) : own_(own) {}

  const std::string& name() const override { return name_; }
  devices::Target mounted() const override { return mounted_; }
  void mount(devices::Target target) override;

 private:
  devices::TargetChanger* own_;
  devices::Target mounted_ = devices::Target::sample;
  std::string name_ = "operator";
};

}  // namespace gonio::cli
