#pragma once

#include <memory>
#include <vector>

#include "gonio/usb_bus/byte_stream.h"
#include "gonio/usb_bus/usb_device.h"

namespace gonio::usb_bus {

/// What one bulk transfer of an FTDI chip carries once its status bytes are taken out.
struct FtdiTransfer {
  std::vector<std::uint8_t> payload;
  std::uint8_t modem_status = 0;  ///< of the last packet
  std::uint8_t line_status = 0;   ///< of all packets together
};

// Line status bits, as those of a 16550 (FTDI AN232B-03, section 3).
inline constexpr std::uint8_t kFtdiOverrun = 0x02;
inline constexpr std::uint8_t kFtdiParity = 0x04;
inline constexpr std::uint8_t kFtdiFraming = 0x08;
inline constexpr std::uint8_t kFtdiLineErrors = kFtdiOverrun | kFtdiParity | kFtdiFraming;

/// Every packet of `packet_size` bytes begins with two status bytes; the last may be shorter.
/// Throws std::invalid_argument for a packet without both.
FtdiTransfer ftdi_payload(std::span<const std::uint8_t> transfer, std::size_t packet_size = 64);

/// A serial line at 115200 8N1 with RTS/CTS behind an FT232 chip, as APT controllers have it
/// (Thorlabs, APT Communications Protocol, section 2.1: set-up, and a rest before and after the
/// purge).
class FtdiPort final : public ByteStream {
 public:
  struct Options {
    Deadline transfer{300};       ///< of one write or set-up request
    std::uint8_t latency_ms = 2;  ///< how long the chip waits for a packet to fill
    std::chrono::milliseconds rest{50};
  };

  explicit FtdiPort(std::shared_ptr<UsbDevice> device);
  FtdiPort(std::shared_ptr<UsbDevice> device, Options options);

  const std::string& name() const override { return device_->name(); }
  void write(std::span<const std::uint8_t> bytes) override;
  std::size_t read(std::span<std::uint8_t> room, Deadline deadline) override;
  void purge() override;
  bool connected() const noexcept override { return device_->connected(); }
  void disconnect() noexcept override { device_->disconnect(); }
  void reconnect(Deadline within) override;

 private:
  void set_up();
  void request(std::uint8_t request, std::uint16_t value, std::uint16_t index);
  bool receive(Deadline deadline);

  std::shared_ptr<UsbDevice> device_;
  Options options_;
  std::vector<std::uint8_t> received_;  ///< not yet read
  std::size_t read_ = 0;                ///< of those
};

}  // namespace gonio::usb_bus
