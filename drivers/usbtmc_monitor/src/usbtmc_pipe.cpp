#include "usbtmc_pipe.h"

#include <algorithm>
#include <stdexcept>
#include <thread>

namespace gonio::usbtmc_monitor {

using devices::DeviceErrc;
using devices::DeviceError;
using Wall = std::chrono::steady_clock;

namespace {

constexpr std::uint32_t kMost = 1024;  // bytes of one answer
constexpr std::size_t kMostParts = 16;
constexpr std::chrono::milliseconds kTransfer{300};  // of a command or a control request
constexpr std::chrono::milliseconds kDrain{20};
constexpr int kMostPolls = 20;
constexpr std::chrono::milliseconds kPollPause{5};

// Requests and their status (tables 15 and 16 of the specification).
constexpr std::uint8_t kToEndpoint = 0xA2;
constexpr std::uint8_t kToInterface = 0xA1;
constexpr std::uint8_t kInitiateAbortBulkIn = 3;
constexpr std::uint8_t kCheckAbortBulkIn = 4;
constexpr std::uint8_t kInitiateClear = 5;
constexpr std::uint8_t kCheckClear = 6;
constexpr std::uint8_t kSuccess = 0x01;
constexpr std::uint8_t kPending = 0x02;

}  // namespace

void UsbtmcPipe::send(std::string_view command) {
  tag_ = next_tag(tag_);
  device_->bulk_out(message_out(tag_, command), left(kTransfer));
}

UsbtmcPipe::Deadline UsbtmcPipe::left(Deadline most) const {
  const auto all = std::chrono::ceil<Deadline>(end_ - now_());
  if (all <= Deadline(0)) {
    throw DeviceError(DeviceErrc::Timeout, device_->name(), "no answer in time");
  }
  return std::min(all, most);
}

std::string UsbtmcPipe::query(std::string_view command) {
  if (to_recover_) recover();
  send(command);
  return receive();
}

std::string UsbtmcPipe::receive() {
  const Wall::time_point end = std::min(now_() + answer_, end_);
  std::string text;
  for (std::size_t part = 0; part < kMostParts; ++part) {
    tag_ = next_tag(tag_);
    device_->bulk_out(request_in(tag_, kMost), left(kTransfer));
    try {
      AnswerHeader header;
      do {
        std::size_t wanted = kHeaderBytes;
        const Bytes transfer = transfer_in(end, wanted);
        header = answer_header(transfer, kMost);
        if (header.tag == tag_) text += answer_text(transfer, header);
      } while (header.tag != tag_);
      if (header.end) return text;
    } catch (const std::invalid_argument& error) {
      throw DeviceError(DeviceErrc::Protocol, device_->name(), error.what());
    }
  }
  throw DeviceError(DeviceErrc::Protocol, device_->name(), "an answer without end");
}

/// One whole transfer, which may take several reads: it ends when it is as long as its header says
/// or with a packet that is not full.
Bytes UsbtmcPipe::transfer_in(Wall::time_point end, std::size_t& wanted) {
  const std::size_t packet = device_->layout().max_packet_in;
  Bytes transfer;
  while (true) {
    const auto left = std::chrono::ceil<Deadline>(end - now_());
    if (left <= Deadline(0)) {
      throw DeviceError(DeviceErrc::Timeout, device_->name(), "no answer in time");
    }
    Bytes room((kHeaderBytes + kMost + packet) / packet * packet);
    const std::size_t count = device_->bulk_in(room, left);
    transfer.insert(transfer.end(), room.begin(),
                    room.begin() + static_cast<std::ptrdiff_t>(count));
    if (transfer.size() >= kHeaderBytes) {
      wanted = kHeaderBytes + answer_header(transfer, kMost).size;
    }
    if (count == 0 || count % packet != 0 || transfer.size() >= wanted) return transfer;
  }
}

Bytes UsbtmcPipe::class_request(std::uint8_t type, std::uint8_t request, std::uint16_t value,
                                std::uint16_t index, std::size_t size) {
  Bytes reply(size);
  reply.resize(device_->control({type, request, value, index}, reply, left(kTransfer)));
  if (reply.empty()) {
    throw DeviceError(DeviceErrc::Protocol, device_->name(), "an empty status");
  }
  return reply;
}

void UsbtmcPipe::recover() {
  for (void (UsbtmcPipe::*const step)() : {&UsbtmcPipe::abort_answer, &UsbtmcPipe::clear}) {
    try {
      (this->*step)();
    } catch (const DeviceError& error) {
      // What cannot be put right now shows in the next query.
      if (error.code() == DeviceErrc::Disconnected) throw;
    }
  }
  to_recover_ = time_is_up();
}

void UsbtmcPipe::abort_answer() {
  const std::uint8_t endpoint = device_->layout().bulk_in;
  if (class_request(kToEndpoint, kInitiateAbortBulkIn, tag_, endpoint, 2)[0] != kSuccess) return;
  drain();
  for (int poll = 0; poll < kMostPolls; ++poll) {
    const Bytes status = class_request(kToEndpoint, kCheckAbortBulkIn, 0, endpoint, 8);
    if (status[0] != kPending) return;
    if (status.size() > 1 && (status[1] & 0x01) != 0) drain();
    std::this_thread::sleep_for(kPollPause);
  }
}

void UsbtmcPipe::clear() {
  const std::uint8_t interface = device_->layout().interface_number;
  if (class_request(kToInterface, kInitiateClear, 0, interface, 1)[0] != kSuccess) return;
  for (int poll = 0; poll < kMostPolls; ++poll) {
    const Bytes status = class_request(kToInterface, kCheckClear, 0, interface, 2);
    if (status[0] != kPending) break;
    if (status.size() > 1 && (status[1] & 0x01) != 0) drain();
    std::this_thread::sleep_for(kPollPause);
  }
  device_->clear_halt(usb_bus::Direction::out);
}

/// Reads up to the packet that is not full, and throws it away.
void UsbtmcPipe::drain() {
  const std::size_t packet = device_->layout().max_packet_in;
  Bytes room(packet * 16);
  try {
    for (std::size_t part = 0; part < kMostParts; ++part) {
      if (device_->bulk_in(room, left(kDrain)) % packet != 0) return;
    }
  } catch (const DeviceError& error) {
    if (error.code() != DeviceErrc::Timeout) throw;
  }
}

}  // namespace gonio::usbtmc_monitor
