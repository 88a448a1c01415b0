// The USB drivers under the contracts of their interfaces, over emulated devices.

#include "light_contract.h"
#include "rotation_stage_contract.h"
#include "usb_rig.h"

namespace gonio::contracts {
namespace {

using namespace gonio::literals;

template <typename Device>
struct Kept {
  std::shared_ptr<UsbRig> rig;  // dies after the device
  std::shared_ptr<Device> device;
};

template <typename Device>
std::shared_ptr<Device> keeping(std::shared_ptr<UsbRig> rig, std::shared_ptr<Device> device) {
  auto kept = std::make_shared<Kept<Device>>(Kept<Device>{std::move(rig), std::move(device)});
  Device* const raw = kept->device.get();
  return {std::move(kept), raw};
}

template <typename Maker>
std::string name_of(const testing::TestParamInfo<Maker>& info) {
  return info.param.name;
}

StageMaker apt(const std::string& name, bool reversed) {
  return {name, [reversed] {
            auto rig = std::make_shared<UsbRig>(reversed);
            auto stage = rig->open_stage();
            // An encoder step and five sigmas of positioning.
            return StageUnderTest{keeping(rig, stage), rig->axis().home, 0.006_deg, true,
                                  [rig](bool connected) {
                                    connected ? rig->bed.plug_in(UsbRig::kStageName)
                                              : rig->bed.unplug(UsbRig::kStageName);
                                  }};
          }};
}

/// The lamp itself is switched in the world: the meter only looks on.
LightMaker meter() {
  return {"pm100d", [] {
            auto rig = std::make_shared<UsbRig>();
            auto monitor = keeping(rig, UsbRig::open_meter());
            return LightUnderTest{
                std::shared_ptr<devices::LightSource>(rig, &rig->world.light_source()), monitor,
                [monitor] { return monitor->read(); }};
          }};
}

INSTANTIATE_TEST_SUITE_P(Usb, LampMonitorContract, testing::Values(meter()), name_of<LightMaker>);
GTEST_ALLOW_UNINSTANTIATED_PARAMETERIZED_TEST(LightSourceContract);

INSTANTIATE_TEST_SUITE_P(Usb, RotationStageContract,
                         testing::Values(apt("k10cr1", false), apt("k10cr1_reversed", true)),
                         name_of<StageMaker>);

}  // namespace
}  // namespace gonio::contracts
