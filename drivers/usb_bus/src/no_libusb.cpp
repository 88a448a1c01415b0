// Stands in for libusb_device.cpp in builds without the library.

#include "gonio/usb_bus/usb_device.h"

namespace gonio::usb_bus {

std::vector<UsbDeviceInfo> list_usb_devices() { return {}; }

std::shared_ptr<UsbDevice> open_usb_device(const std::string& name, const UsbAddress& address) {
  throw devices::DeviceError(devices::DeviceErrc::Disconnected, name,
                             address.to_string() + ": this program was built without libusb");
}

}  // namespace gonio::usb_bus
