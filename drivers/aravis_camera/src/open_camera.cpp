#include "open_camera.h"

#include <arpa/inet.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <string>

#include "gonio/aravis_camera/aravis_camera.h"
#include "gonio/devices/device_error.h"
#include "quiet_glib.h"

namespace gonio::aravis_camera {
namespace {

constexpr std::uint16_t kGvcpPort = 3956;

bool is_ipv4(const std::string& text) {
  in_addr ignored{};
  return inet_pton(AF_INET, text.c_str(), &ignored) == 1;
}

/// The address of ours from which packets to `device` go out; empty when there is no way.
std::string local_address_towards(const std::string& device) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(kGvcpPort);
  inet_pton(AF_INET, device.c_str(), &address.sin_addr);
  const int probe = socket(AF_INET, SOCK_DGRAM, 0);
  sockaddr_in own{};
  socklen_t size = sizeof own;
  // Connecting a datagram socket sends nothing.
  const bool found =
      connect(probe, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0 &&
      getsockname(probe, reinterpret_cast<sockaddr*>(&own), &size) == 0;
  close(probe);
  std::array<char, INET_ADDRSTRLEN> text{};
  if (found) inet_ntop(AF_INET, &own.sin_addr, text.data(), text.size());
  return text.data();
}

/// Whether something answered, though not as a camera does.
bool was_answered(const GError* error) {
  if (error == nullptr || error->domain != ARV_DEVICE_ERROR) return error != nullptr;
  return error->code != ARV_DEVICE_ERROR_TIMEOUT && error->code != ARV_DEVICE_ERROR_NOT_FOUND &&
         error->code != ARV_DEVICE_ERROR_NOT_CONNECTED;
}

}  // namespace

Handle<ArvCamera> open_camera(const AravisCameraOptions& options) {
  const auto disconnected = [&](const std::string& message) {
    return devices::DeviceError(devices::DeviceErrc::Disconnected, options.name, message);
  };
  quiet_glib();
  GError* error = nullptr;
  Handle<ArvCamera> camera;
  if (is_ipv4(options.device)) {
    // Straight to the address: no search, no broadcast, no look at the USB.
    const std::string own = local_address_towards(options.device);
    if (own.empty()) throw disconnected("no network reaches " + options.device);
    const Handle<GInetAddress> from(g_inet_address_new_from_string(own.c_str()));
    const Handle<GInetAddress> to(g_inet_address_new_from_string(options.device.c_str()));
    const Handle<ArvDevice> device(arv_gv_device_new(from.get(), to.get(), &error));
    if (device) camera.reset(arv_camera_new_with_device(device.get(), &error));
  } else {
    arv_update_device_list();
    camera.reset(arv_camera_new(options.device.c_str(), &error));
  }
  if (!camera || error != nullptr) {
    const bool answered = was_answered(error);
    const std::string why = error != nullptr ? error->message : "";
    g_clear_error(&error);
    if (answered) {
      throw devices::DeviceError(devices::DeviceErrc::Protocol, options.name,
                                 "what answers at " + options.device +
                                     " is no GigE Vision or USB3 Vision camera (" + why +
                                     "): is that its address? gonio devices lists the cameras");
    }
    throw disconnected("no camera answers at " + options.device +
                       ": power, cable and network; gonio devices lists what answers");
  }
  ArvDevice* const device = arv_camera_get_device(camera.get());
  if (ARV_IS_GV_DEVICE(device) && arv_gv_device_is_controller(ARV_GV_DEVICE(device)) == 0) {
    throw disconnected(
        "another program controls the camera, or one that died less than 3 s ago did");
  }
  return camera;
}

std::vector<CameraDeviceInfo> list_cameras() {
  const auto said = [](const char* text) { return std::string(text == nullptr ? "" : text); };
  quiet_glib();
  arv_update_device_list();
  std::vector<CameraDeviceInfo> found;
  for (unsigned index = 0; index < arv_get_n_devices(); ++index) {
    found.push_back({said(arv_get_device_id(index)), said(arv_get_device_vendor(index)),
                     said(arv_get_device_model(index)), said(arv_get_device_serial_nbr(index)),
                     said(arv_get_device_address(index)), said(arv_get_device_protocol(index))});
  }
  return found;
}

}  // namespace gonio::aravis_camera
