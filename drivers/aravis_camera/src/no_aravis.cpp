// Stands in for the files that use Aravis in builds without the library.

#include <utility>

#include "gonio/aravis_camera/aravis_camera.h"

namespace gonio::aravis_camera {

AravisCamera::AravisCamera(const AravisCameraOptions& options, const devices::SteadyClock& clock,
                           std::stop_token stop)
    : AravisCamera(options, clock, aravis_opener(options), std::move(stop)) {}

LinkOpener aravis_opener(const AravisCameraOptions& options) {
  return [name = options.name]() -> std::unique_ptr<CameraLink> {
    throw devices::DeviceError(devices::DeviceErrc::Fault, name,
                               "this program was built without Aravis");
  };
}

std::vector<CameraDeviceInfo> list_cameras() { return {}; }

}  // namespace gonio::aravis_camera
