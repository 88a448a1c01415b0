#include "power_meter.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "descriptors.h"

namespace gonio::usb_emulator {

using emulator_faults::Fault;

namespace {

constexpr std::uint8_t kClassIn = 0xA1;     // to an interface
constexpr std::uint8_t kEndpointIn = 0xA2;  // to an endpoint
constexpr std::uint8_t kSuccess = 0x01;
constexpr std::uint8_t kNotInProgress = 0x81;
constexpr std::size_t kBulkHeader = 12;
constexpr std::size_t kInputBuffer = 1024;

}  // namespace

PowerMeter::PowerMeter(PowerMeterOptions options, devices::LampMonitor& monitor,
                       devices::Clock& clock, emulator_faults::FaultPlan& faults)
    : options_(std::move(options)),
      identity_(identity_of(
          {0x1313, 0x8078, "Thorlabs", "PM100D", options_.serial, 0xFE, 0x03, 0x01, {0x01, 0x82}})),
      monitor_(monitor),
      clock_(clock),
      faults_(faults) {}

void PowerMeter::restart() {
  clear();
  errors_.clear();
}

void PowerMeter::clear() {
  input_.clear();
  output_.clear();
  request_.reset();
  leaving_.clear();
  abort_ends_ = false;
}

std::optional<Bytes> PowerMeter::control(const Setup& setup, std::span<const std::uint8_t>) {
  const auto tag = static_cast<std::uint8_t>(setup.value);
  if (setup.request_type == kEndpointIn && (setup.request == 1 || setup.request == 3)) {
    const bool in_progress =
        setup.request == 1 ? !input_.empty() : request_ && request_->tag == tag;
    if (!in_progress) return Bytes{kNotInProgress, tag};
    if (setup.request == 1) {
      input_.clear();
    } else {
      request_.reset();
      leaving_.clear();
      abort_ends_ = true;
    }
    return Bytes{kSuccess, tag};
  }
  if (setup.request_type == kEndpointIn && (setup.request == 2 || setup.request == 4)) {
    return Bytes{kSuccess, 0, 0, 0, 0, 0, 0, 0};
  }
  if (setup.request_type == kClassIn && setup.request == 5) {  // INITIATE_CLEAR
    clear();
    return Bytes{kSuccess};
  }
  if (setup.request_type == kClassIn && setup.request == 6) return Bytes{kSuccess, 0};
  if (setup.request_type == kClassIn && setup.request == 7) {  // GET_CAPABILITIES
    Bytes capabilities(24, 0);
    capabilities[0] = kSuccess;
    capabilities[3] = 0x01;  // bcdUSBTMC 1.00
    return capabilities;
  }
  return std::nullopt;
}

void PowerMeter::bulk_out(std::span<const std::uint8_t> bytes) {
  const bool whole = bytes.size() >= kBulkHeader && (bytes[1] ^ bytes[2]) == 0xFF && bytes[1] != 0;
  if (!whole) {
    error(-100, "Command error");
    return;
  }
  const auto size = static_cast<std::uint32_t>(bytes[4] | bytes[5] << 8U | bytes[6] << 16U |
                                               static_cast<std::uint32_t>(bytes[7]) << 24U);
  message(bytes[0], bytes[1], size, (bytes[8] & 0x01) != 0, bytes.subspan(kBulkHeader));
}

void PowerMeter::message(std::uint8_t id, std::uint8_t tag, std::uint32_t size, bool end,
                         std::span<const std::uint8_t> payload) {
  if (id == 1) {
    // The payload is padded to whole words: anything else is a driver's error.
    if (size > payload.size() || payload.size() - size > 3 ||
        (kBulkHeader + payload.size()) % 4 != 0 || input_.size() + size > kInputBuffer) {
      error(-100, "Command error");
      return;
    }
    input_.append(payload.begin(), payload.begin() + size);
    if (end) command(std::exchange(input_, {}));
  } else if (id == 2) {
    request_ = Request{tag, size};
    if (output_.empty()) error(-420, "Query UNTERMINATED");
  }
}

void PowerMeter::command(std::string text) {
  while (!text.empty() && (text.back() == '\n' || text.back() == '\r')) text.pop_back();
  if (!output_.empty()) error(-410, "Query INTERRUPTED");
  output_.clear();
  if (faults_.strikes(Fault::dead_link, name(), clock_.now())) return;
  if (text == "*IDN?") {
    output_ = fmt::format("Thorlabs,PM100D,{},2.4.0\n", options_.serial);
  } else if (text == "MEAS:POW?") {
    output_ = fmt::format("{:.8E}\n", monitor_.read());
  } else if (text == "SYST:ERR?") {
    output_ = errors_.empty() ? "+0,\"No error\"\n" : errors_.front() + "\n";
    if (!errors_.empty()) errors_.pop_front();
  } else if (text == "*CLS" || text == "*RST") {
    errors_.clear();
  } else {
    error(-113, "Undefined header");
  }
}

void PowerMeter::error(int code, const char* text) {
  errors_.push_back(fmt::format("{},\"{}\"", code, text));
}

std::optional<Bytes> PowerMeter::bulk_in(std::size_t room, Wall::time_point) {
  if (std::exchange(abort_ends_, false)) return Bytes{};
  if (leaving_.empty() && request_ && !output_.empty()) {
    const std::size_t count = std::min(request_->most, output_.size());
    const bool end = count == output_.size();
    const auto size = static_cast<std::uint32_t>(count);
    leaving_ = {2,
                request_->tag,
                static_cast<std::uint8_t>(~request_->tag),
                0,
                static_cast<std::uint8_t>(size),
                static_cast<std::uint8_t>(size >> 8U),
                static_cast<std::uint8_t>(size >> 16U),
                static_cast<std::uint8_t>(size >> 24U),
                static_cast<std::uint8_t>(end ? 1 : 0),
                0,
                0,
                0};
    leaving_.insert(leaving_.end(), output_.begin(),
                    output_.begin() + static_cast<std::ptrdiff_t>(count));
    output_.erase(0, count);
    request_.reset();
    if (faults_.strikes(Fault::torn_reply, name(), clock_.now())) {
      leaving_.resize(leaving_.size() / 2);
      output_.clear();
    }
  }
  if (leaving_.empty()) return std::nullopt;
  const std::size_t count = std::min(room, leaving_.size());
  const auto part = leaving_.begin() + static_cast<std::ptrdiff_t>(count);
  Bytes sent(leaving_.begin(), part);
  leaving_.erase(leaving_.begin(), part);
  return sent;
}

}  // namespace gonio::usb_emulator
