// The only file that knows libmodbus. It brings the serial port, the CRC and the framing by length;
// what is asked and whether it is answered is ours (request.h), because libmodbus compares neither
// the echo of a write nor, in raw requests, transaction ids. Its own link recovery is never used:
// it can loop for ever while a link is down (libmodbus 3.1.6, send_msg).

#include <fmt/format.h>
#include <modbus/modbus.h>
#include <netdb.h>
#include <poll.h>
#include <sys/file.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <memory>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "gonio/modbus_bus/open_bus.h"
#include "line_turn.h"

namespace gonio::modbus_bus {
namespace {

using devices::DeviceErrc;
using devices::DeviceError;
using Wall = std::chrono::steady_clock;

constexpr std::size_t kTcpHeader = 6;  // transaction, protocol, length; the unit comes after it
constexpr std::size_t kCrc = 2;
/// Above 19200 baud the silences have a fixed length (MODBUS over Serial Line V1.02, 2.5.1.1).
constexpr int kFastBaud = 19200;
constexpr std::chrono::microseconds kFastSilence{1750};
/// Before a unit that refused for the moment is asked again.
constexpr std::chrono::milliseconds kBusyPause{20};
constexpr std::chrono::milliseconds kListenSlice{5};
/// So many response times after a missing answer it is still expected.
constexpr int kLateWindow = 4;
/// By then the rest of a frame has come whose first bytes have (256 characters at 38400 baud).
constexpr std::chrono::milliseconds kWholeFrame{70};

struct CloseAndFree {
  void operator()(modbus_t* context) const noexcept {
    modbus_close(context);
    modbus_free(context);
  }
};
using Context = std::unique_ptr<modbus_t, CloseAndFree>;

/// Why an attempt has failed.
struct Failure {
  DeviceErrc code;
  std::string what;
  bool again;         ///< another attempt may help ...
  bool done_nothing;  ///< ... and the unit has not acted on this one
};

bool link_is_gone(int error) {
  return error == EIO || error == ECONNRESET || error == EPIPE || error == EBADF ||
         error == ENODEV || error == ENXIO || error == ENOTCONN || error == ECONNABORTED;
}

/// What is no Modbus in the header of a TCP frame (MODBUS Messaging on TCP/IP V1.0b, 3.1.3), or
/// nothing.
std::string wrong_in_header(std::span<const std::uint8_t> frame) {
  const int protocol = frame[2] << 8U | frame[3];
  if (protocol != 0) return fmt::format("found protocol {}, expected 0: no Modbus", protocol);
  const std::size_t said = static_cast<std::size_t>(frame[4]) << 8U | frame[5];
  if (said == frame.size() - kTcpHeader) return {};
  return fmt::format("broken answer: it says {} bytes and has {}", said, frame.size() - kTcpHeader);
}

/// The numeric addresses of a host. Throws DeviceError.
std::vector<std::string> addresses_of(const TcpEndpoint& tcp, const std::string& line) {
  const auto refuse = [&](int error) {
    throw DeviceError(DeviceErrc::Disconnected, line,
                      fmt::format("cannot find the host \"{}\" ({}); is the name right? An address "
                                  "in the rig file needs no name server",
                                  tcp.host, ::gai_strerror(error)));
  };
  addrinfo wanted{};
  wanted.ai_socktype = SOCK_STREAM;
  addrinfo* found = nullptr;
  if (const int error = ::getaddrinfo(tcp.host.c_str(), nullptr, &wanted, &found); error != 0) {
    refuse(error);
  }
  const std::unique_ptr<addrinfo, decltype(&::freeaddrinfo)> owner(found, &::freeaddrinfo);
  std::vector<std::string> addresses;
  for (const addrinfo* each = found; each != nullptr; each = each->ai_next) {
    std::array<char, NI_MAXHOST> text{};
    const int error = ::getnameinfo(each->ai_addr, each->ai_addrlen, text.data(), text.size(),
                                    nullptr, 0, NI_NUMERICHOST);
    if (error != 0) refuse(error);
    addresses.emplace_back(text.data());
  }
  return addresses;
}

class LibmodbusBus final : public ModbusBus {
 public:
  LibmodbusBus(const RtuLine& rtu, const BusOptions& options)
      : name_(rtu.path), rtu_(rtu), options_(options) {
    rtu.validate();
    options.validate();
    open(name_);
  }
  LibmodbusBus(const TcpEndpoint& tcp, const BusOptions& options)
      : name_(fmt::format("{}:{}", tcp.host, tcp.port)), tcp_(tcp), options_(options) {
    options.validate();
    const std::vector<std::string> addresses = addresses_of(tcp, name_);
    for (std::size_t i = 0; !context_; ++i) {
      tcp_->host = addresses[i];
      try {
        open(name_);
      } catch (const DeviceError&) {
        if (i + 1 == addresses.size()) throw;
      }
    }
  }

  const std::string& line() const override { return name_; }

  std::vector<std::uint16_t> transact(const Station& station, const Request& request,
                                      const Manner& manner) override {
    if (station.unit < 1 || station.unit > 247) {
      throw std::invalid_argument(
          fmt::format("{}: unit: found {}, expected 1 to 247", station.device, station.unit));
    }
    for (int attempt = 0;;) {
      std::vector<std::uint16_t> words;
      std::optional<Failure> failure;
      {
        const auto hold = turn_.take(manner.urgent);
        if (!manner.urgent && !late_answers_are_over()) continue;  // somebody urgent waits
        if (manner.given_up && manner.given_up()) {
          throw DeviceError(DeviceErrc::Stopped, station.device, "stopped before it was sent");
        }
        open_if_closed(station.device, manner.urgent);
        failure = exchange(station, request, words);
        if (!failure && wary_ && !manner.urgent) failure = find_second_answer();
      }
      if (!failure) return words;
      const bool harmless = manner.repeatable || failure->done_nothing;
      const bool last = manner.attempts == Attempts::one;
      if (!failure->again || !harmless || last || attempt++ >= options_.retries) {
        throw DeviceError(failure->code, station.device,
                          fmt::format("{} (unit {} on {})", failure->what, station.unit, name_));
      }
      if (failure->done_nothing) std::this_thread::sleep_for(kBusyPause);
    }
  }

 private:
  /// One attempt; without a Failure, `words` holds what was read. The turn is held.
  std::optional<Failure> exchange(const Station& station, const Request& request,
                                  std::vector<std::uint16_t>& words) {
    const std::vector<std::uint8_t> sent = encode(station.unit, request);
    if (rtu_) std::this_thread::sleep_until(free_from_);
    modbus_flush(context_.get());  // what is left of anything before
    if (!send(station.unit, sent)) return lost("sending failed");
    const std::size_t answer_bytes = request.reads() ? 5U + 2U * request.count : 8U;
    const Wall::time_point deadline =
        Wall::now() + options_.response_timeout + time_on_line(sent.size() + kCrc + answer_bytes);

    std::string foreign;
    while (true) {
      std::array<std::uint8_t, MODBUS_MAX_ADU_LENGTH> buffer{};
      const int received = receive(buffer.data(), deadline);
      free_from_ = Wall::now() + silence();
      if (received < 0) return without_answer(errno, foreign);
      if (received == 0) {  // libmodbus: a frame of another unit
        foreign = "answer of another unit";
        continue;
      }
      const auto length = static_cast<std::size_t>(received);
      std::span<const std::uint8_t> frame(buffer.data(), length);
      if (tcp_) {
        if (frame[0] != transaction_ >> 8U || frame[1] != (transaction_ & 0xFFU)) {
          foreign = "answer of another transaction";
          continue;
        }
        // libmodbus takes lengths from the function code and looks at neither field.
        if (const std::string wrong = wrong_in_header(frame); !wrong.empty()) {
          expect_late_answer();
          return Failure{DeviceErrc::Protocol, wrong, true, false};
        }
        frame = frame.subspan(kTcpHeader);
      } else {
        frame = frame.first(length - kCrc);
      }
      Answer answer = decode(station.unit, request, frame);
      switch (answer.kind) {
        case Answer::Kind::good:
          words = std::move(answer.words);
          return std::nullopt;
        case Answer::Kind::exception:
          return Failure{errc_of_exception(answer.exception),
                         "refused: " + exception_text(answer.exception),
                         worth_repeating(answer.exception), true};
        case Answer::Kind::foreign:
          foreign = std::move(answer.what);
          continue;
        case Answer::Kind::malformed:
          expect_late_answer();
          return Failure{DeviceErrc::Protocol, "broken answer: " + answer.what, true, false};
      }
    }
  }

  bool send(int unit, const std::vector<std::uint8_t>& frame) {
    modbus_set_slave(context_.get(), unit);
    if (rtu_) {
      const int length = static_cast<int>(frame.size());
      return modbus_send_raw_request(context_.get(), frame.data(), length) >= length;
    }
    ++transaction_;
    const auto length = static_cast<std::uint16_t>(frame.size());
    std::vector<std::uint8_t> bytes{static_cast<std::uint8_t>(transaction_ >> 8U),
                                    static_cast<std::uint8_t>(transaction_ & 0xFFU),
                                    0,
                                    0,
                                    static_cast<std::uint8_t>(length >> 8U),
                                    static_cast<std::uint8_t>(length & 0xFFU)};
    bytes.insert(bytes.end(), frame.begin(), frame.end());
    const int socket = modbus_get_socket(context_.get());
    return ::send(socket, bytes.data(), bytes.size(), MSG_NOSIGNAL) ==
           static_cast<ssize_t>(bytes.size());
  }

  /// As modbus_receive_confirmation(), within what is left until `deadline`; -1 and errno.
  int receive(std::uint8_t* buffer, Wall::time_point deadline) {
    const auto left =
        std::chrono::duration_cast<std::chrono::microseconds>(deadline - Wall::now()).count();
    if (left <= 0) {
      errno = ETIMEDOUT;
      return -1;
    }
    // Without a byte timeout the response timeout holds for the whole answer.
    modbus_set_byte_timeout(context_.get(), 0, 0);
    modbus_set_response_timeout(context_.get(), static_cast<std::uint32_t>(left / 1000000),
                                static_cast<std::uint32_t>(left % 1000000));
    return modbus_receive_confirmation(context_.get(), buffer);
  }

  Failure without_answer(int error, const std::string& foreign) {
    if (link_is_gone(error)) return lost("the link is gone");
    if (error == EMBBADCRC) {
      // It may have been noise, and the answer come behind it: in time, and after the flush.
      expect_late_answer(1);
      wary_ = true;
      return {DeviceErrc::Protocol, "wrong checksum", true, false};
    }
    expect_late_answer();
    if (error != ETIMEDOUT) {
      return {DeviceErrc::Protocol, std::string("broken answer: ") + modbus_strerror(error), true,
              false};
    }
    if (!foreign.empty()) return {DeviceErrc::Protocol, foreign, true, false};
    return {DeviceErrc::Timeout,
            fmt::format("no whole answer within {} ms: is it on, is the unit right?",
                        options_.response_timeout.count()),
            true, false};
  }

  /// RTU has nothing by which to tell a late answer from the one to the next request, so a line
  /// with an answer outstanding is listened to. A TCP connection takes its late answers with it.
  void expect_late_answer(int response_timeouts = kLateWindow) {
    if (tcp_) {
      context_.reset();
      return;
    }
    ++outstanding_;
    listen_until_ =
        std::max(listen_until_, Wall::now() + response_timeouts * options_.response_timeout);
  }

  /// Listens until all that is outstanding has come or will not come any more. False when somebody
  /// urgent waits.
  bool late_answers_are_over() {
    while (context_ && outstanding_ > 0 && Wall::now() < listen_until_) {
      if (turn_.urgent_waits()) return false;
      if (!bytes_come()) continue;
      std::this_thread::sleep_for(kWholeFrame);
      modbus_flush(context_.get());
      if (--outstanding_ == 0) return true;
    }
    wary_ = wary_ || outstanding_ > 0;
    outstanding_ = 0;
    return true;
  }

  /// Where an answer never came, the first one after it may be that one, later still: then another
  /// follows.
  std::optional<Failure> find_second_answer() {
    const Wall::time_point quiet = Wall::now() + options_.response_timeout;
    while (Wall::now() < quiet) {
      if (turn_.urgent_waits()) return std::nullopt;  // wary still
      if (bytes_come()) {
        expect_late_answer();
        return Failure{DeviceErrc::Protocol, "two answers to one request", true, false};
      }
    }
    wary_ = false;
    return std::nullopt;
  }

  bool bytes_come() {
    pollfd line{modbus_get_socket(context_.get()), POLLIN, 0};
    return ::poll(&line, 1, static_cast<int>(kListenSlice.count())) > 0;
  }

  Failure lost(const char* what) {
    context_.reset();
    return {DeviceErrc::Disconnected, what, false, false};
  }

  void open_if_closed(const std::string& device, bool urgent) {
    if (context_ && tcp_) {
      std::uint8_t byte = 0;
      const int socket = modbus_get_socket(context_.get());
      // The other side may close while nothing is asked; better found before a request is lost.
      const auto peeked = ::recv(socket, &byte, 1, MSG_PEEK | MSG_DONTWAIT);
      if (peeked == 0 || (peeked < 0 && errno != EAGAIN && errno != EWOULDBLOCK)) context_.reset();
    }
    if (context_) return;
    if (!urgent && Wall::now() < no_open_before_) {
      throw DeviceError(DeviceErrc::Disconnected, device, fmt::format("{} is not open", name_));
    }
    open(device);
  }

  void open(const std::string& device) {
    const auto refuse = [&](const std::string& why) {
      no_open_before_ = Wall::now() + options_.reopen_interval;
      throw DeviceError(DeviceErrc::Disconnected, device,
                        device == name_ ? fmt::format("cannot open: {}", why)
                                        : fmt::format("cannot open {}: {}", name_, why));
    };
    const std::string port = tcp_ ? std::to_string(tcp_->port) : "";
    Context context(
        tcp_ ? modbus_new_tcp_pi(tcp_->host.c_str(), port.c_str())
             : modbus_new_rtu(rtu_->path.c_str(), rtu_->baud, rtu_->parity, 8, rtu_->stop_bits));
    if (!context) refuse("unusable address");
    const std::int64_t us = std::chrono::microseconds(options_.response_timeout).count();
    modbus_set_response_timeout(context.get(), static_cast<std::uint32_t>(us / 1000000),
                                static_cast<std::uint32_t>(us % 1000000));
    bool connected = modbus_connect(context.get()) == 0;
    // The C library reads the line's settings back; who changes them at that moment, as whatever
    // has the other end of a pseudo-terminal may, makes it take them for refused.
    if (!connected && rtu_ && errno == EINVAL) connected = modbus_connect(context.get()) == 0;
    if (!connected) {
      // What libmodbus leaves in errno after a failed connection is not the reason.
      const int error = errno;
      if (tcp_) refuse("no connection; is the device on, are host and port right?");
      const std::string reason = error == ENOTTY ? "no serial port" : modbus_strerror(error);
      refuse(reason + "; `gonio devices` lists the ports that are there");
    }
    if (rtu_ && ::flock(modbus_get_socket(context.get()), LOCK_EX | LOCK_NB) != 0) {
      refuse("another program has it");
    }
    context_ = std::move(context);
    free_from_ = Wall::now() + silence();
  }

  std::chrono::nanoseconds time_on_line(std::size_t bytes) const {
    return rtu_ ? rtu_->character_time() * static_cast<std::int64_t>(bytes)
                : std::chrono::nanoseconds(0);
  }

  std::chrono::nanoseconds silence() const {
    if (!rtu_) return std::chrono::nanoseconds(0);
    if (rtu_->baud > kFastBaud) return kFastSilence;
    return rtu_->character_time() * 7 / 2;
  }

  std::string name_;
  std::optional<RtuLine> rtu_;
  std::optional<TcpEndpoint> tcp_;
  BusOptions options_;
  LineTurn turn_;
  // With the turn only:
  Context context_;
  Wall::time_point free_from_{};
  Wall::time_point no_open_before_{};
  std::uint16_t transaction_ = 0;
  // RTU:
  int outstanding_ = 0;  ///< answers that did not come in time and may still
  Wall::time_point listen_until_{};
  bool wary_ = false;  ///< one of them never came, or may come behind the next
};

}  // namespace

void RtuLine::validate() const {
  const auto refuse = [](const char* field, const std::string& found, const char* expected) {
    throw std::invalid_argument(
        fmt::format("Modbus line: {}: found {}, expected {}", field, found, expected));
  };
  if (path.empty()) refuse("port", "none", "a serial port");
  if (baud < 300 || baud > 4000000) refuse("baud", std::to_string(baud), "300 to 4000000");
  if (parity != 'N' && parity != 'E' && parity != 'O') {
    refuse("parity", std::string(1, parity), "N, E or O");
  }
  if (stop_bits != 1 && stop_bits != 2) refuse("stop_bits", std::to_string(stop_bits), "1 or 2");
}

std::chrono::nanoseconds RtuLine::character_time() const {
  const int bits = 1 + 8 + (parity == 'N' ? 0 : 1) + stop_bits;
  return std::chrono::nanoseconds(bits * std::int64_t{1000000000} / baud);
}

void BusOptions::validate() const {
  const auto refuse = [](const char* field, std::int64_t found, const char* expected) {
    throw std::invalid_argument(
        fmt::format("Modbus line: {}: found {}, expected {}", field, found, expected));
  };
  if (response_timeout.count() < 1 || response_timeout.count() > 60000) {
    refuse("response_timeout_ms", response_timeout.count(), "1 to 60000");
  }
  if (retries < 0 || retries > 10) refuse("retries", retries, "0 to 10");
  if (reopen_interval.count() < 0) {
    refuse("reopen_interval_ms", reopen_interval.count(), "0 or more");
  }
}

std::shared_ptr<ModbusBus> open_rtu(const RtuLine& line, const BusOptions& options) {
  return std::make_shared<LibmodbusBus>(line, options);
}

std::shared_ptr<ModbusBus> open_tcp(const TcpEndpoint& endpoint, const BusOptions& options) {
  return std::make_shared<LibmodbusBus>(endpoint, options);
}

}  // namespace gonio::modbus_bus
