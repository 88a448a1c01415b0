// The camera driver under the contract of Camera, over the wire: an emulated GigE Vision camera on
// loopback that looks at a simulated world.

#include "camera_contract.h"
#include "emulated_camera.h"
#include "private_loopback.h"

namespace gonio::contracts {
namespace {

const auto* const kLoopback = testing::AddGlobalTestEnvironment(new PrivateLoopback);

CameraMaker camera(const std::string& format) {
  return {format, [format] {
            const auto made = std::make_shared<EmulatedCamera>(format);
            return CameraUnderTest{{made, &made->camera()},
                                   {made, &made->clock()},
                                   [made](bool on) {
                                     if (on) {
                                       made->light().light(made->light().channels().front().name);
                                     } else {
                                       made->light().close_shutter();
                                     }
                                   },
                                   std::chrono::milliseconds(20),
                                   std::max(1.0, made->dn_per_adc_step()),
                                   [made](bool on) {
                                     if (on) {
                                       made->emulator().plug_in();
                                     } else {
                                       made->emulator().unplug();
                                     }
                                   }};
          }};
}

std::string name_of(const testing::TestParamInfo<CameraMaker>& info) { return info.param.name; }

INSTANTIATE_TEST_SUITE_P(Aravis, CameraContract,
                         testing::Values(camera("Mono8"), camera("Mono12p"), camera("Mono16"),
                                         camera("BayerRG12"), camera("BayerRG12Packed")),
                         name_of);

}  // namespace
}  // namespace gonio::contracts
