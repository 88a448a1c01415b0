#pragma once

#include <string>

#include "gonio/devices/target_changer.h"

namespace gonio::calibration::routine::test {

/// Puts another target into the holder than it is asked for.
class CarelessChanger final : public devices::TargetChanger {
 public:
  CarelessChanger(devices::TargetChanger& real, devices::Target asked, devices::Target given)
      : real_(real), asked_(asked), given_(given) {}
  /// From now on.
  void give(devices::Target given) {
    given_ = given;
    believed_ = devices::Target::sample;
  }
  const std::string& name() const override { return real_.name(); }
  devices::Target mounted() const override { return believed_; }
  void mount(devices::Target target) override {
    real_.mount(target == asked_ ? given_ : target);
    believed_ = target;
  }

 private:
  devices::TargetChanger& real_;
  devices::Target asked_;
  devices::Target given_;
  devices::Target believed_ = devices::Target::sample;
};

}  // namespace gonio::calibration::routine::test
