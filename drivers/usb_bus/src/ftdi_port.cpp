#include "gonio/usb_bus/ftdi_port.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <stdexcept>
#include <thread>
#include <utility>

namespace gonio::usb_bus {

using devices::DeviceErrc;
using devices::DeviceError;

namespace {

constexpr std::size_t kStatusBytes = 2;
constexpr std::size_t kReadPackets = 8;

// Requests and their values as libftdi sends them for an FT232R.
constexpr std::uint8_t kVendorOut = 0x40;
constexpr std::uint8_t kReset = 0x00;
constexpr std::uint16_t kResetChip = 0;
constexpr std::uint16_t kPurgeReceived = 1;
constexpr std::uint16_t kPurgeUnsent = 2;
constexpr std::uint8_t kModemControl = 0x01;
constexpr std::uint16_t kRtsOn = 0x0202;
constexpr std::uint8_t kFlowControl = 0x02;
constexpr std::uint16_t kRtsCts = 0x0100;  // in the index
constexpr std::uint8_t kBaudRate = 0x03;
constexpr std::uint16_t kBaud115200 = 0x001A;  // 3 MHz / 26
constexpr std::uint8_t kDataFormat = 0x04;
constexpr std::uint16_t k8N1 = 0x0008;
constexpr std::uint8_t kLatency = 0x09;
constexpr std::uint16_t kPort = 1;  // first and only port of the chip

}  // namespace

FtdiTransfer ftdi_payload(std::span<const std::uint8_t> transfer, std::size_t packet_size) {
  FtdiTransfer result;
  while (!transfer.empty()) {
    const auto packet = transfer.first(std::min(packet_size, transfer.size()));
    if (packet.size() < kStatusBytes) {
      throw std::invalid_argument(
          fmt::format("packet of {} bytes, expected two status bytes first", packet.size()));
    }
    result.modem_status = packet[0];
    result.line_status |= packet[1];
    result.payload.insert(result.payload.end(), packet.begin() + kStatusBytes, packet.end());
    transfer = transfer.subspan(packet.size());
  }
  return result;
}

FtdiPort::FtdiPort(std::shared_ptr<UsbDevice> device) : FtdiPort(std::move(device), Options()) {}

FtdiPort::FtdiPort(std::shared_ptr<UsbDevice> device, Options options)
    : device_(std::move(device)), options_(options) {
  set_up();
}

void FtdiPort::set_up() {
  request(kReset, kResetChip, kPort);
  request(kBaudRate, kBaud115200, 0);
  request(kDataFormat, k8N1, kPort);
  request(kLatency, options_.latency_ms, kPort);
  std::this_thread::sleep_for(options_.rest);
  purge();
  std::this_thread::sleep_for(options_.rest);
  request(kFlowControl, 0, kRtsCts | kPort);
  request(kModemControl, kRtsOn, kPort);
}

void FtdiPort::request(std::uint8_t request, std::uint16_t value, std::uint16_t index) {
  device_->control({kVendorOut, request, value, index}, {}, options_.transfer);
}

void FtdiPort::purge() {
  received_.clear();
  read_ = 0;
  request(kReset, kPurgeReceived, kPort);
  request(kReset, kPurgeUnsent, kPort);
}

void FtdiPort::write(std::span<const std::uint8_t> bytes) {
  device_->bulk_out(bytes, options_.transfer);
}

std::size_t FtdiPort::read(std::span<std::uint8_t> room, Deadline deadline) {
  using Wall = std::chrono::steady_clock;
  const Wall::time_point end = Wall::now() + deadline;
  while (read_ == received_.size()) {
    // Rounded up: a last transfer of less than a millisecond would have no deadline at all.
    const auto left = std::chrono::ceil<Deadline>(end - Wall::now());
    // The chip answers every few milliseconds with its status alone; no answer is no byte.
    if (!receive(std::max(left, Deadline(options_.latency_ms + 1)))) return 0;
    if (read_ == received_.size() && Wall::now() >= end) return 0;
  }
  const std::size_t count = std::min(room.size(), received_.size() - read_);
  std::copy_n(received_.begin() + static_cast<std::ptrdiff_t>(read_), count, room.begin());
  read_ += count;
  return count;
}

bool FtdiPort::receive(Deadline deadline) {
  const std::size_t packet_size = device_->layout().max_packet_in;
  std::vector<std::uint8_t> transfer(kReadPackets * packet_size);
  try {
    transfer.resize(device_->bulk_in(transfer, deadline));
  } catch (const DeviceError& error) {
    if (error.code() != DeviceErrc::Timeout) throw;
    return false;
  }
  try {
    FtdiTransfer parsed = ftdi_payload(transfer, packet_size);
    if ((parsed.line_status & kFtdiLineErrors) != 0) {
      throw DeviceError(DeviceErrc::Protocol, name(),
                        fmt::format("the serial line lost or garbled bytes (line status {:#04x}); "
                                    "check the cable",
                                    parsed.line_status));
    }
    received_ = std::move(parsed.payload);
    read_ = 0;
  } catch (const std::invalid_argument& error) {
    throw DeviceError(DeviceErrc::Protocol, name(), error.what());
  }
  return true;
}

void FtdiPort::reconnect(Deadline within) {
  if (device_->connected()) return;
  device_->reconnect(within);
  try {
    set_up();
  } catch (...) {
    device_->disconnect();  // a line that is half set up does not count as one
    throw;
  }
}

}  // namespace gonio::usb_bus
