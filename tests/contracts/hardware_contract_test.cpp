// The contracts on the devices of a rig file, opened as the program opens them.
//
// GONIO_HARDWARE_RIG names the rig file. Axes travel all they may and the lamp shines: clear the
// rig, put a white or grey plate on the cradle, stay beside it. In continuous integration the same
// program runs inside `gonio-emulate rigs/wire.toml`.

#include <cstdlib>
#include <string_view>
#include <vector>

#include "camera_contract.h"
#include "gonio/opened_rig/opened_rig.h"
#include "gonio/opened_rig/watchdog.h"
#include "gonio/rig/kinematics.h"
#include "light_contract.h"
#include "rotation_stage_contract.h"

namespace gonio::contracts {
namespace {

using namespace gonio::literals;
using namespace std::chrono_literals;

constexpr std::chrono::milliseconds kPatience{300000};

/// Nothing without GONIO_HARDWARE_RIG.
const cli::RigFile* rig_file() {
  static const auto rig = []() -> std::optional<cli::RigFile> {
    const char* path = std::getenv("GONIO_HARDWARE_RIG");
    if (path == nullptr) return std::nullopt;
    return cli::read_rig_file(path);
  }();
  return rig ? &*rig : nullptr;
}

std::shared_ptr<cli::OpenedRig> open(cli::Parts parts) {
  return cli::open_hardware_rig(*rig_file(), parts, {});
}

template <typename Device>
std::shared_ptr<Device> part_of(const std::shared_ptr<cli::OpenedRig>& rig, Device* device) {
  return {rig, device};
}

std::vector<StageMaker> stages() {
  std::vector<StageMaker> all;
  for (std::size_t i = 0; rig_file() != nullptr && i < rig_file()->rig.axes.size(); ++i) {
    const rig::Axis& axis = rig_file()->rig.axes[i];
    all.push_back({axis.name, [i, home = axis.home] {
                     const auto rig = open(cli::Parts::axes_and_lamp);
                     StageUnderTest made{part_of(rig, rig->devices().stages[i]), home, 0.03_deg};
                     made.just_powered_up = false;
                     return made;
                   }});
  }
  return all;
}

/// With the plate turned to the lamp, as for theta_i = 45, theta_o = 0 deg.
std::shared_ptr<cli::OpenedRig> open_ready() {
  const auto rig = open(cli::Parts::all);
  const rig::Reach reach = rig::Inverse(rig_file()->rig).solve({22.5_deg, 22.5_deg, 0_deg, 0_deg});
  const auto& axes = rig->devices().stages;
  for (std::size_t i = 0; i < axes.size(); ++i) {
    axes[i]->rearm();
    axes[i]->home(kPatience);
    axes[i]->begin_move_to(reach.poses.at(0).joints[i]);
  }
  for (devices::RotationStage* axis : axes) axis->wait_until_settled(kPatience);
  return rig;
}

std::vector<CameraMaker> cameras() {
  if (rig_file() == nullptr) return {};
  return {{"camera", [] {
             const auto rig = open_ready();
             devices::LightSource* const lamp = rig->devices().light;
             return CameraUnderTest{part_of(rig, rig->devices().camera),
                                    part_of(rig, rig->devices().clock),
                                    [lamp](bool on) {
                                      if (on) {
                                        lamp->light(lamp->channels().front().name);
                                      } else {
                                        lamp->close_shutter();
                                      }
                                    },
                                    rig_file()->session.first_exposure, 1.0};
           }}};
}

std::vector<LightMaker> lights() {
  if (rig_file() == nullptr || rig_file()->devices.monitor.serial.empty()) return {};
  return {{"lamp", [] {
             const auto rig = open(cli::Parts::all);
             devices::LampMonitor* const monitor = rig->devices().monitor;
             return LightUnderTest{part_of(rig, rig->devices().light), part_of(rig, monitor),
                                   [monitor] { return monitor->read(); }};
           }}};
}

template <typename Maker>
std::string name_of_device(const testing::TestParamInfo<Maker>& info) {
  return info.param.name;
}

INSTANTIATE_TEST_SUITE_P(Hardware, RotationStageContract, testing::ValuesIn(stages()),
                         name_of_device<StageMaker>);
INSTANTIATE_TEST_SUITE_P(Hardware, CameraContract, testing::ValuesIn(cameras()),
                         name_of_device<CameraMaker>);
INSTANTIATE_TEST_SUITE_P(Hardware, LightSourceContract, testing::ValuesIn(lights()),
                         name_of_device<LightMaker>);
INSTANTIATE_TEST_SUITE_P(Hardware, LampMonitorContract, testing::ValuesIn(lights()),
                         name_of_device<LightMaker>);
GTEST_ALLOW_UNINSTANTIATED_PARAMETERIZED_TEST(RotationStageContract);
GTEST_ALLOW_UNINSTANTIATED_PARAMETERIZED_TEST(CameraContract);
GTEST_ALLOW_UNINSTANTIATED_PARAMETERIZED_TEST(LightSourceContract);
GTEST_ALLOW_UNINSTANTIATED_PARAMETERIZED_TEST(LampMonitorContract);

TEST(HardwareRig, IsConfigured) {
  if (rig_file() == nullptr) GTEST_SKIP() << "GONIO_HARDWARE_RIG names no rig file";
  EXPECT_EQ(rig_file()->driver, cli::RigFile::Driver::hardware);
}

}  // namespace
}  // namespace gonio::contracts

int main(int argc, char** argv) {
  // The watchdog of an opened rig is the program itself, started once more.
  if (argc == 2 && std::string_view(argv[1]) == gonio::cli::kWatchdogArgument) {
    return gonio::cli::run_watchdog();
  }
  testing::InitGoogleMock(&argc, argv);
  return RUN_ALL_TESTS();
}
