#pragma once

#include <string>

#include "gonio/devices/target_changer.h"

namespace gonio::cli {

/// A person at the terminal, who changes the target. On a simulated rig what he does is done to its
/// world as well.
///
/// State    What lies there at first counts as the sample.
/// Errors   DeviceError, Stopped: nobody confirmed.
class AskingChanger final : public devices::TargetChanger {
 public:
  /// `simulated`  The world's own changer; null on a rig of metal.
  explicit AskingChanger(devices::TargetChanger* simulated) : simulated_(simulated) {}

  const std::string& name() const override { return name_; }
  devices::Target mounted() const override { return mounted_; }
  void mount(devices::Target target) override;

 private:
  devices::TargetChanger* simulated_;
  devices::Target mounted_ = devices::Target::sample;
  std::string name_ = "operator";
};

}  // namespace gonio::cli
