#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "gonio/devices/device_error.h"

/// USB devices that are driven without a kernel driver. The only user of libusb.
namespace gonio::usb_bus {

/// One device on the bus, as it says itself.
struct UsbDeviceInfo {
  std::uint16_t vendor = 0;
  std::uint16_t product = 0;
  std::string serial;       ///< empty: it has none, or it may not be opened
  std::string description;  ///< product string, or empty as above
  std::string manufacturer;
  int bus = 0;
  int address = 0;             ///< on that bus; another one after every replug
  bool is_instrument = false;  ///< has a USBTMC interface
  std::string trouble;         ///< why it could not be asked for its strings; empty: it was
};

/// Everything on the bus, ordered by bus and address. Claims nothing. Empty where there is no USB.
std::vector<UsbDeviceInfo> list_usb_devices();

/// "0403:faf0".
std::string to_string_of_id(std::uint16_t vendor, std::uint16_t product);

/// Class and subclass of an interface (USB class codes, usb.org).
struct InterfaceClass {
  std::uint8_t code;
  std::uint8_t subclass;
};
inline constexpr InterfaceClass kUsbtmcClass{0xFE, 0x03};

/// Which device is meant.
struct UsbAddress {
  std::optional<std::uint16_t> vendor;   ///< none: any
  std::optional<std::uint16_t> product;  ///< none: any
  std::string serial;                    ///< empty: the only one that fits; two are refused
  std::optional<InterfaceClass> interface_class;  ///< of the interface to claim; none: the first

  /// For messages: "0403:faf0, serial 55000123".
  std::string to_string() const;
};

enum class Direction { in, out };  ///< as USB counts: in is towards the host

/// The first eight bytes of a control transfer, without the length (USB 2.0, 9.3).
struct ControlSetup {
  std::uint8_t request_type = 0;  ///< bit 7: in
  std::uint8_t request = 0;
  std::uint16_t value = 0;
  std::uint16_t index = 0;

  friend bool operator==(const ControlSetup&, const ControlSetup&) = default;
};

/// What the claimed interface looks like.
struct UsbLayout {
  std::uint8_t interface_number = 0;
  std::uint8_t bulk_in = 0x81;  ///< endpoint address
  std::uint8_t bulk_out = 0x02;
  std::size_t max_packet_in = 64;
};

/// One claimed interface of one device: the seam under the FTDI port and the USBTMC pipe, so that
/// both can be tested without a bus.
///
/// Deadlines Every transfer has its own, in the host's time. stop() of whoever stands above waits
/// for
///          its own transfer only: transfers of different threads run side by side.
/// State    Claimed once constructed. After Disconnected nothing works until reconnect().
/// Threads  All members from any thread.
/// Errors   DeviceError: Timeout; Disconnected (unplugged, absent, held by another program, no
///          permission); Protocol (endpoint stalled, which is cleared; transfer broken).
class UsbDevice {
 public:
  using Deadline = std::chrono::milliseconds;

  virtual ~UsbDevice() = default;
  UsbDevice(const UsbDevice&) = delete;
  UsbDevice& operator=(const UsbDevice&) = delete;

  /// What errors call it.
  virtual const std::string& name() const = 0;
  virtual UsbLayout layout() const = 0;

  virtual bool connected() const noexcept = 0;
  /// Lets go of it, as if it had been unplugged; transfers under way end by themselves.
  virtual void disconnect() noexcept = 0;
  /// Looks for the same device, by serial if it had one, and claims it again. Returns at once while
  /// connected. Throws Disconnected when it is not there `within` the time.
  virtual void reconnect(Deadline within) = 0;

  /// Returns the bytes moved: all of `data` outwards, at most so many inwards.
  virtual std::size_t control(const ControlSetup& setup, std::span<std::uint8_t> data,
                              Deadline deadline) = 0;
  /// Sends all bytes or throws.
  virtual void bulk_out(std::span<const std::uint8_t> bytes, Deadline deadline) = 0;
  /// One transfer: returns what came, at least one byte unless the device sent an empty packet.
  /// `room` is a multiple of the packet size. Throws Timeout when nothing came.
  virtual std::size_t bulk_in(std::span<std::uint8_t> room, Deadline deadline) = 0;
  virtual void clear_halt(Direction direction) = 0;

 protected:
  UsbDevice() = default;
};

/// Opens and claims. `name` is what errors call it (the axis or device name of the rig file). A
/// kernel driver that holds the interface is put aside meanwhile. Throws Disconnected saying what
/// to do.
std::shared_ptr<UsbDevice> open_usb_device(const std::string& name, const UsbAddress& address);

}  // namespace gonio::usb_bus
