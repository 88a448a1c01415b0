// Bytes of an FTDI chip as they come from USB, down to APT messages.

#include <algorithm>
#include <cstdlib>
#include <stdexcept>

#include "gonio/apt_stage/apt_decoder.h"
#include "gonio/usb_bus/ftdi_port.h"
#include "trial.h"

namespace {

using namespace gonio::apt_stage;

/// Whatever the message says, taking it apart must not fail.
void take_apart(const Message& message) {
  const auto info = hardware_info(message);
  if (info && info->model.size() > 8) std::abort();
  const auto status = status_update(message);
  if (status) describe_status(status->bits);
  velocity_params(message);
  home_params(message);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  std::span<const std::uint8_t> bytes(data, size);
  AptDecoder decoder;
  std::size_t fed = 0;
  std::size_t decoded = 0;
  while (!bytes.empty()) {
    // The first byte of each piece is its length: how USB happened to cut the stream.
    const auto piece = bytes.first(std::min<std::size_t>(bytes.size(), 1U + bytes.front()));
    bytes = bytes.subspan(piece.size());
    try {
      const auto transfer = gonio::usb_bus::ftdi_payload(piece.subspan(1));
      decoder.feed(transfer.payload);
      fed += transfer.payload.size();
    } catch (const std::invalid_argument&) {
    }
    while (const auto message = decoder.next()) {
      take_apart(*message);
      decoded += encode(*message).size();
    }
  }
  // No byte is lost and none is counted twice.
  if (fed != decoded + decoder.skipped() + decoder.pending()) std::abort();
  return 0;
}
