// The Modbus drivers over their wires, under the contracts of their interfaces.

#include "light_contract.h"
#include "modbus_rig.h"
#include "rotation_stage_contract.h"
#include "target_changer_contract.h"
#include "throws_device_error.h"

namespace gonio::contracts {
namespace {

using namespace gonio::literals;

const std::vector<std::string> kNoFaults;
constexpr modbus_bus::BusOptions kReopensAtOnce{.reopen_interval = 0ms};

StageMaker stage(Family family, std::size_t axis, const std::string& name) {
  return {name, [family, axis] {
            const auto rig = std::make_shared<ModbusRig>(family, kNoFaults, kReopensAtOnce);
            std::shared_ptr<devices::RotationStage> made = rig->stage(axis);
            // An encoder step, five sigmas of positioning, half a step of the drive.
            return StageUnderTest{
                {made.get(), [rig, made](devices::RotationStage*) mutable { made.reset(); }},
                rig->world().truth().rig.axes[axis].home,
                0.007_deg,
                true,
                [rig](bool connected) {
                  if (connected) {
                    rig->plug_in_line();
                  } else {
                    rig->unplug_line();
                  }
                }};
          }};
}

LightMaker light() {
  return {"rgb", [] {
            const auto rig =
                std::make_shared<ModbusRig>(Family::leadshine, kNoFaults, kReopensAtOnce);
            std::shared_ptr<devices::LightSource> made = rig->light();
            auto* const monitor = &rig->world().lamp_monitor();
            return LightUnderTest{
                {made.get(), [rig, made](devices::LightSource*) mutable { made.reset(); }},
                {rig, monitor},
                [monitor] { return monitor->read(); },
                [rig](bool connected) {
                  if (connected) {
                    rig->plug_in_server();
                  } else {
                    rig->unplug_server();
                  }
                }};
          }};
}

ChangerMaker changer() {
  return {"changer", [] {
            const auto rig = std::make_shared<ModbusRig>(Family::leadshine);
            std::shared_ptr<devices::TargetChanger> made = rig->changer();
            return std::shared_ptr<devices::TargetChanger>(
                made.get(), [rig, made](devices::TargetChanger*) mutable { made.reset(); });
          }};
}

template <typename Maker>
std::string name_of_maker(const testing::TestParamInfo<Maker>& info) {
  return info.param.name;
}

INSTANTIATE_TEST_SUITE_P(Modbus, RotationStageContract,
                         testing::Values(stage(Family::leadshine, 0, "leadshine"),
                                         stage(Family::leadshine, 1, "leadshine_reversed"),
                                         stage(Family::az, 2, "az"),
                                         stage(Family::az, 1, "az_reversed")),
                         name_of_maker<StageMaker>);
GTEST_ALLOW_UNINSTANTIATED_PARAMETERIZED_TEST(LampMonitorContract);  // no monitor on Modbus
INSTANTIATE_TEST_SUITE_P(Modbus, LightSourceContract, testing::Values(light()),
                         name_of_maker<LightMaker>);
INSTANTIATE_TEST_SUITE_P(Modbus, TargetChangerContract, testing::Values(changer()),
                         name_of_maker<ChangerMaker>);

// What the world's own changer does, on its own time, and what it refuses shows on the wire.
TEST(ModbusChangerOnTheWire, MovesTheWorldsAndStaysWhereItRefuses) {
  ModbusRig rig(Family::leadshine);
  const auto changer = rig.changer();
  const auto before = rig.clock().now();
  changer->mount(devices::Target::mirror_turned);
  EXPECT_GE(rig.clock().now() - before, rig.world().truth().change_time);
  EXPECT_EQ(rig.world().target_changer().mounted(), devices::Target::mirror_turned);
  rig.world().light_source().light("R");
  EXPECT_THAT([&] { changer->mount(devices::Target::white); },
              ThrowsDeviceError(devices::DeviceErrc::Fault));
  EXPECT_EQ(changer->mounted(), devices::Target::mirror_turned);
  rig.world().light_source().close_shutter();
  changer->mount(devices::Target::white);
  EXPECT_EQ(rig.world().target_changer().mounted(), devices::Target::white);
}

}  // namespace
}  // namespace gonio::contracts
