#pragma once

#include <optional>
#include <string>

#include "gonio/devices/target_changer.h"

namespace gonio::cli {

/// A person at the terminal, who changes the target. On a simulated rig what he does is done to its
/// world as well.
///
/// Errors   DeviceError, Stopped: nobody confirmed.
class AskingChanger final : public devices::TargetChanger {
 public:
  /// `lies_there`  What is on the rig now; none: not known, so that the first is asked for.
  AskingChanger(devices::TargetChanger* simulated, std::optional<devices::Target> lies_there)
      : simulated_(simulated), mounted_(lies_there) {}

  const std::string& name() const override { return name_; }
  devices::Target mounted() const override;
  void mount(devices::Target target) override;

 private:
  devices::TargetChanger* simulated_;
  std::optional<devices::Target> mounted_;
  std::string name_ = "operator";
};

}  // namespace gonio::cli
