// The only file that includes libusb.

#include <fmt/format.h>
#include <libusb.h>

#include <algorithm>
#include <array>
#include <mutex>
#include <thread>
#include <utility>

#include "gonio/usb_bus/usb_device.h"

namespace gonio::usb_bus {

using devices::DeviceErrc;
using devices::DeviceError;

namespace {

constexpr std::chrono::milliseconds kSearchPause{50};
constexpr std::uint8_t kDirectionIn = 0x80;

struct ExitContext {
  void operator()(libusb_context* context) const noexcept { libusb_exit(context); }
};
struct FreeList {
  void operator()(libusb_device** list) const noexcept { libusb_free_device_list(list, 1); }
};
struct FreeConfig {
  void operator()(libusb_config_descriptor* config) const noexcept {
    libusb_free_config_descriptor(config);
  }
};
struct CloseHandle {
  void operator()(libusb_device_handle* handle) const noexcept { libusb_close(handle); }
};
using ContextPtr = std::unique_ptr<libusb_context, ExitContext>;
using ConfigPtr = std::unique_ptr<libusb_config_descriptor, FreeConfig>;
using HandlePtr = std::unique_ptr<libusb_device_handle, CloseHandle>;

/// Null where there is no USB at all.
ContextPtr new_context() {
  libusb_context* context = nullptr;
  return ContextPtr(libusb_init(&context) == LIBUSB_SUCCESS ? context : nullptr);
}

/// Keeps the devices alive for the walk.
class DeviceList {
 public:
  explicit DeviceList(libusb_context* context) {
    libusb_device** list = nullptr;
    const auto count = libusb_get_device_list(context, &list);
    list_.reset(list);
    if (count > 0) devices_ = {list, static_cast<std::size_t>(count)};
  }
  auto begin() const { return devices_.begin(); }
  auto end() const { return devices_.end(); }

 private:
  std::unique_ptr<libusb_device*, FreeList> list_;
  std::span<libusb_device*> devices_;
};

[[noreturn]] void fail(const std::string& name, const std::string& what, int code) {
  const auto error = [&](DeviceErrc errc, const char* advice) {
    return DeviceError(errc, name, fmt::format("{}: {}", what, advice));
  };
  switch (code) {
    case LIBUSB_ERROR_TIMEOUT:
      throw error(DeviceErrc::Timeout, "no answer; is the device switched on?");
    case LIBUSB_ERROR_NO_DEVICE:
    case LIBUSB_ERROR_NOT_FOUND:
      throw error(DeviceErrc::Disconnected, "unplugged; plug it in and home again");
    case LIBUSB_ERROR_BUSY:
      throw error(DeviceErrc::Disconnected, "busy: another program has it; close that one first");
    case LIBUSB_ERROR_ACCESS:
      throw error(DeviceErrc::Disconnected,
                  "no permission; install rigs/udev/70-gonio.rules and replug (docs/hardware.md)");
    case LIBUSB_ERROR_PIPE:
      throw error(DeviceErrc::Protocol, "the device stalled the transfer");
    case LIBUSB_ERROR_OVERFLOW:
      throw error(DeviceErrc::Protocol, "the device sent more than was asked for");
    default:
      throw error(DeviceErrc::Protocol, libusb_error_name(code));
  }
}

/// Returns `code` when it is no error.
int check(const std::string& name, const std::string& what, int code) {
  if (code < 0) fail(name, what, code);
  return code;
}

std::string text_of(libusb_device_handle* handle, std::uint8_t index) {
  if (index == 0) return {};
  std::array<unsigned char, 256> text{};
  const int size =
      libusb_get_string_descriptor_ascii(handle, index, text.data(), static_cast<int>(text.size()));
  return size > 0 ? std::string(text.begin(), text.begin() + size) : std::string();
}

ConfigPtr config_of(libusb_device* device) {
  libusb_config_descriptor* config = nullptr;
  return ConfigPtr(
      libusb_get_active_config_descriptor(device, &config) == LIBUSB_SUCCESS ? config : nullptr);
}

/// The first alternate setting of the interface that is meant; null when it has none such.
const libusb_interface_descriptor* interface_of(const libusb_config_descriptor* config,
                                                const std::optional<InterfaceClass>& wanted) {
  if (config == nullptr) return nullptr;
  for (const libusb_interface& candidate :
       std::span(config->interface, static_cast<std::size_t>(config->bNumInterfaces))) {
    if (candidate.num_altsetting < 1) continue;
    const libusb_interface_descriptor& first = candidate.altsetting[0];
    if (!wanted ||
        (first.bInterfaceClass == wanted->code && first.bInterfaceSubClass == wanted->subclass)) {
      return &first;
    }
  }
  return nullptr;
}

std::optional<UsbLayout> layout_of(const libusb_interface_descriptor& chosen) {
  UsbLayout layout{chosen.bInterfaceNumber, 0, 0, 0};
  for (const libusb_endpoint_descriptor& endpoint :
       std::span(chosen.endpoint, static_cast<std::size_t>(chosen.bNumEndpoints))) {
    if ((endpoint.bmAttributes & 0x03) != LIBUSB_TRANSFER_TYPE_BULK) continue;
    const bool in = (endpoint.bEndpointAddress & kDirectionIn) != 0;
    if (in && layout.bulk_in == 0) {
      layout.bulk_in = endpoint.bEndpointAddress;
      layout.max_packet_in = endpoint.wMaxPacketSize;
    } else if (!in && layout.bulk_out == 0) {
      layout.bulk_out = endpoint.bEndpointAddress;
    }
  }
  if (layout.bulk_in == 0 || layout.bulk_out == 0 || layout.max_packet_in == 0) return std::nullopt;
  return layout;
}

/// One opening of the device: dies with the last transfer that uses it.
struct Connection {
  ContextPtr context;  // its own, so that no other device's events are handled here
  HandlePtr handle;
  UsbLayout layout;
  std::string serial;

  ~Connection() {
    if (handle) libusb_release_interface(handle.get(), layout.interface_number);
  }
};

/// Opens what fits the address, without claiming. Throws Disconnected.
std::shared_ptr<Connection> open_connection(const std::string& name, const UsbAddress& address) {
  auto opened = std::make_shared<Connection>();
  opened->context = new_context();
  if (!opened->context) {
    throw DeviceError(DeviceErrc::Disconnected, name, "this machine has no USB");
  }
  std::string refused;  // of a device that may be the one
  std::string others;
  const DeviceList list(opened->context.get());
  HandlePtr found;
  for (libusb_device* const device : list) {
    libusb_device_descriptor descriptor{};
    if (libusb_get_device_descriptor(device, &descriptor) != LIBUSB_SUCCESS) continue;
    if (address.vendor.value_or(descriptor.idVendor) != descriptor.idVendor) continue;
    if (address.product.value_or(descriptor.idProduct) != descriptor.idProduct) continue;
    const ConfigPtr config = config_of(device);
    const auto* const chosen = interface_of(config.get(), address.interface_class);
    if (chosen == nullptr) continue;
    libusb_device_handle* raw = nullptr;
    if (const int code = libusb_open(device, &raw); code != LIBUSB_SUCCESS) {
      refused = code == LIBUSB_ERROR_ACCESS
                    ? "no permission; install rigs/udev/70-gonio.rules and replug "
                      "(docs/hardware.md)"
                    : libusb_error_name(code);
      continue;
    }
    HandlePtr handle(raw);
    const std::string serial = text_of(raw, descriptor.iSerialNumber);
    if (!address.serial.empty() && serial != address.serial) {
      others += (others.empty() ? "" : ", ") + serial;
      continue;
    }
    const std::optional<UsbLayout> layout = layout_of(*chosen);
    if (!layout) continue;
    if (found) {
      throw DeviceError(DeviceErrc::Disconnected, name,
                        fmt::format("{}: serials {} and {} both fit; name one", address.to_string(),
                                    opened->serial, serial));
    }
    found = std::move(handle);
    opened->layout = *layout;
    opened->serial = serial;
  }
  if (!found) {
    const std::string why = !refused.empty()  ? refused
                            : !others.empty() ? "not found, only serial " + others
                                              : "not found; plug it in and switch it on";
    throw DeviceError(DeviceErrc::Disconnected, name,
                      fmt::format("USB device {}: {}", address.to_string(), why));
  }
  libusb_set_auto_detach_kernel_driver(found.get(), 1);
  check(name, "claim " + address.to_string(),
        libusb_claim_interface(found.get(), opened->layout.interface_number));
  opened->handle = std::move(found);  // only now: what is not claimed is not released
  return opened;
}

class LibusbDevice final : public UsbDevice {
 public:
  LibusbDevice(std::string name, UsbAddress address)
      : name_(std::move(name)),
        address_(std::move(address)),
        connection_(open_connection(name_, address_)),
        layout_(connection_->layout) {
    address_.serial = connection_->serial;
  }

  const std::string& name() const override { return name_; }

  UsbLayout layout() const override {
    const std::lock_guard lock(mutex_);
    return layout_;
  }

  bool connected() const noexcept override {
    const std::lock_guard lock(mutex_);
    return connection_ != nullptr;
  }

  void disconnect() noexcept override {
    std::shared_ptr<Connection> dropped;  // closed after the lock
    const std::lock_guard lock(mutex_);
    dropped.swap(connection_);
  }

  void reconnect(Deadline within) override {
    if (connected()) return;
    const auto end = std::chrono::steady_clock::now() + within;
    while (true) {
      try {
        auto opened = open_connection(name_, address_);
        const std::lock_guard lock(mutex_);
        layout_ = opened->layout;
        connection_ = std::move(opened);
        return;
      } catch (const DeviceError&) {
        if (std::chrono::steady_clock::now() >= end) throw;
      }
      std::this_thread::sleep_for(kSearchPause);
    }
  }

  std::size_t control(const ControlSetup& setup, std::span<std::uint8_t> data,
                      Deadline deadline) override {
    const auto used = use();
    const int code = libusb_control_transfer(
        used->handle.get(), setup.request_type, setup.request, setup.value, setup.index,
        data.data(), static_cast<std::uint16_t>(data.size()), milliseconds(deadline));
    note(code, used);
    return static_cast<std::size_t>(
        check(name_, fmt::format("control request {:#04x}", setup.request), code));
  }

  void bulk_out(std::span<const std::uint8_t> bytes, Deadline deadline) override {
    const auto used = use();
    // libusb takes the same pointer for both directions.
    std::vector<std::uint8_t> copy(bytes.begin(), bytes.end());
    int done = 0;
    const int code =
        libusb_bulk_transfer(used->handle.get(), used->layout.bulk_out, copy.data(),
                             static_cast<int>(copy.size()), &done, milliseconds(deadline));
    note(code, used);
    if (code == LIBUSB_ERROR_PIPE) libusb_clear_halt(used->handle.get(), used->layout.bulk_out);
    check(name_, "sending", code);
    if (done != static_cast<int>(bytes.size())) {
      throw DeviceError(DeviceErrc::Protocol, name_,
                        fmt::format("sent {} of {} bytes", done, bytes.size()));
    }
  }

  std::size_t bulk_in(std::span<std::uint8_t> room, Deadline deadline) override {
    const auto used = use();
    int done = 0;
    const int code =
        libusb_bulk_transfer(used->handle.get(), used->layout.bulk_in, room.data(),
                             static_cast<int>(room.size()), &done, milliseconds(deadline));
    note(code, used);
    if (code == LIBUSB_ERROR_PIPE) libusb_clear_halt(used->handle.get(), used->layout.bulk_in);
    if (code == LIBUSB_ERROR_TIMEOUT && done > 0) return static_cast<std::size_t>(done);
    check(name_, "receiving", code);
    return static_cast<std::size_t>(done);
  }

  void clear_halt(Direction direction) override {
    const auto used = use();
    const int code =
        libusb_clear_halt(used->handle.get(), direction == Direction::in ? used->layout.bulk_in
                                                                         : used->layout.bulk_out);
    note(code, used);
    check(name_, "clearing a stalled endpoint", code);
  }

 private:
  static unsigned int milliseconds(Deadline deadline) {
    return static_cast<unsigned int>(std::max<Deadline::rep>(deadline.count(), 1));  // 0: for ever
  }

  std::shared_ptr<Connection> use() const {
    const std::lock_guard lock(mutex_);
    if (!connection_) fail(name_, address_.to_string(), LIBUSB_ERROR_NO_DEVICE);
    return connection_;
  }

  /// A device that has gone is let go of, so that the one that comes back can be claimed.
  void note(int code, const std::shared_ptr<Connection>& used) {
    if (code != LIBUSB_ERROR_NO_DEVICE) return;
    const std::lock_guard lock(mutex_);
    if (connection_ == used) connection_.reset();
  }

  std::string name_;
  UsbAddress address_;
  mutable std::mutex mutex_;  // of the connection's life, never held during a transfer
  std::shared_ptr<Connection> connection_;
  UsbLayout layout_;
};

}  // namespace

std::vector<UsbDeviceInfo> list_usb_devices() {
  std::vector<UsbDeviceInfo> found;
  const ContextPtr context = new_context();
  if (!context) return found;
  for (libusb_device* const device : DeviceList(context.get())) {
    libusb_device_descriptor descriptor{};
    if (libusb_get_device_descriptor(device, &descriptor) != LIBUSB_SUCCESS) continue;
    UsbDeviceInfo info;
    info.vendor = descriptor.idVendor;
    info.product = descriptor.idProduct;
    info.bus = libusb_get_bus_number(device);
    info.address = libusb_get_device_address(device);
    info.is_instrument = interface_of(config_of(device).get(), kUsbtmcClass) != nullptr;
    libusb_device_handle* raw = nullptr;
    if (const int code = libusb_open(device, &raw); code == LIBUSB_SUCCESS) {
      const HandlePtr handle(raw);
      info.serial = text_of(raw, descriptor.iSerialNumber);
      info.description = text_of(raw, descriptor.iProduct);
      info.manufacturer = text_of(raw, descriptor.iManufacturer);
    } else {
      info.trouble = code == LIBUSB_ERROR_ACCESS ? "no permission" : libusb_error_name(code);
    }
    found.push_back(std::move(info));
  }
  std::sort(found.begin(), found.end(), [](const UsbDeviceInfo& a, const UsbDeviceInfo& b) {
    return std::pair(a.bus, a.address) < std::pair(b.bus, b.address);
  });
  return found;
}

std::shared_ptr<UsbDevice> open_usb_device(const std::string& name, const UsbAddress& address) {
  return std::make_shared<LibusbDevice>(name, address);
}

}  // namespace gonio::usb_bus
