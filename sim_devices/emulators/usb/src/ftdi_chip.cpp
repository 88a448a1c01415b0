#include "ftdi_chip.h"

#include <algorithm>
#include <utility>

#include "descriptors.h"

namespace gonio::usb_emulator {
namespace {

// FTDI vendor requests (AN232B and the datasheet of the FT232R).
constexpr std::uint8_t kVendorRequestOut = 0x40;
constexpr std::uint8_t kSioReset = 0;
constexpr std::uint8_t kSioModemControl = 1;
constexpr std::uint8_t kSioFlowControl = 2;
constexpr std::uint8_t kSioBaudRate = 3;
constexpr std::uint8_t kSioData = 4;
constexpr std::uint8_t kSioLatencyTimer = 9;

constexpr std::uint16_t kDivisor115200 = 26;  // of 3 MHz
constexpr std::uint16_t kEightBitsNoParity = 8;
constexpr std::chrono::nanoseconds kByteTime{10 * 1000000000LL * 26 / 3000000};  // start, 8, stop
constexpr std::uint8_t kModemStatus = 0x11;                                      // CTS
constexpr std::uint8_t kLineStatus = 0x60;  // transmitter empty
constexpr std::size_t kPacket = 64;
constexpr std::size_t kPacketPayload = kPacket - 2;

}  // namespace

FtdiChip::FtdiChip(std::unique_ptr<AptDrive> drive, const std::string& serial)
    : drive_(std::move(drive)),
      identity_(identity_of({0x0403,
                             0xFAF0,
                             "Thorlabs",
                             "Kinesis K10CR1 Rotary Stage",
                             serial,
                             0xFF,
                             0xFF,
                             0xFF,
                             {0x81, 0x02}})) {}

std::optional<Bytes> FtdiChip::control(const Setup& setup, std::span<const std::uint8_t>) {
  if (setup.request_type != kVendorRequestOut) return std::nullopt;
  switch (setup.request) {
    case kSioReset:
      if (setup.value == 0) rts_cts_ = rts_ = false;
      if (setup.value == 1) {
        // What is still on the line comes all the same.
        while (!to_host_.empty() && to_host_.front().arrives <= Wall::now()) to_host_.pop_front();
      }
      return Bytes{};
    case kSioModemControl:
      if ((setup.value & 0x0200) != 0) rts_ = (setup.value & 0x02) != 0;
      return Bytes{};
    case kSioFlowControl:
      rts_cts_ = (setup.index & 0x0100) != 0;
      return Bytes{};
    case kSioBaudRate:
      divisor_ = setup.value;
      return Bytes{};
    case kSioData:
      format_ = setup.value;
      return Bytes{};
    case kSioLatencyTimer:
      latency_ = std::chrono::milliseconds(setup.value);
      return Bytes{};
    default:
      return std::nullopt;
  }
}

bool FtdiChip::line_is_right() const {
  return divisor_ == kDivisor115200 && format_ == kEightBitsNoParity && rts_cts_ && rts_;
}

void FtdiChip::bulk_out(std::span<const std::uint8_t> bytes) {
  if (!line_is_right()) return;
  to_drive_at_ = std::max(Wall::now(), to_drive_at_) + kByteTime * bytes.size();
  to_drive_.insert(to_drive_.end(), bytes.begin(), bytes.end());
}

void FtdiChip::step() {
  if (!to_drive_.empty() && Wall::now() >= to_drive_at_) {
    const Bytes whole(to_drive_.begin(), to_drive_.end());
    to_drive_.clear();
    drive_->receive(whole);
  }
  drive_->step();
  send_to_host(drive_->take_output());
}

void FtdiChip::send_to_host(const Bytes& bytes) {
  if (bytes.empty()) return;
  to_host_at_ = std::max(Wall::now(), to_host_at_);
  for (const std::uint8_t byte : bytes) {
    to_host_at_ += kByteTime;
    to_host_.push_back({to_host_at_, byte});
  }
}

std::optional<Bytes> FtdiChip::bulk_in(std::size_t room, Wall::time_point since) {
  const Wall::time_point now = Wall::now();
  const bool any = !to_host_.empty() && to_host_.front().arrives <= now;
  // A packet goes when it is full or the latency timer has run out.
  const auto there = static_cast<std::size_t>(
      std::find_if(to_host_.begin(), to_host_.end(),
                   [&](const OnTheLine& waiting) { return waiting.arrives > now; }) -
      to_host_.begin());
  if (there < kPacketPayload && now < since + latency_) return std::nullopt;
  Bytes transfer;
  do {
    transfer.push_back(kModemStatus);
    transfer.push_back(kLineStatus);
    for (std::size_t byte = 0; byte < kPacketPayload; ++byte) {
      if (to_host_.empty() || to_host_.front().arrives > now) break;
      transfer.push_back(to_host_.front().byte);
      to_host_.pop_front();
    }
  } while (any && transfer.size() % kPacket == 0 && transfer.size() + kPacket <= room);
  return transfer;
}

void FtdiChip::restart() {
  divisor_ = 0;
  format_ = 0;
  rts_cts_ = rts_ = false;
  latency_ = std::chrono::milliseconds(16);
  to_host_.clear();
  to_drive_.clear();
  drive_->restart();
}

}  // namespace gonio::usb_emulator
