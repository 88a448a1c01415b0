#include "gonio/modbus_emulator/rtu_line.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <termios.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <cstdlib>
#include <system_error>
#include <thread>
#include <utility>
#include <vector>

#include "descriptor.h"
#include "gonio/modbus_emulator/frames.h"
#include "units.h"

namespace gonio::modbus_emulator {
namespace {

using Host = std::chrono::steady_clock;

/// Silence after which what came before is a frame or rubbish. Longer than 3.5 characters, because
/// a host may pause within a frame where a serial port would not.
constexpr std::chrono::milliseconds kFrameEnds{8};

[[noreturn]] void fail(const char* what) {
  throw std::system_error(errno, std::generic_category(), what);
}

Descriptor checked(int fd, const char* what) {
  if (fd < 0) fail(what);
  return Descriptor(fd);
}

}  // namespace

class ModbusRtuLine::Line {
 public:
  Line(const Options& options, Faults faults, const devices::Clock& clock)
      : options_(options),
        units_(std::move(faults), clock),
        master_(checked(::posix_openpt(O_RDWR | O_NOCTTY | O_CLOEXEC), "pseudo-terminal")),
        wake_(checked(::eventfd(0, EFD_CLOEXEC), "eventfd")) {
    std::array<char, 128> path{};
    if (::grantpt(master_.get()) != 0 || ::unlockpt(master_.get()) != 0 ||
        ::ptsname_r(master_.get(), path.data(), path.size()) != 0) {
      fail("pseudo-terminal");
    }
    // Held open: without any slave end the master reads errors.
    slave_ = checked(::open(path.data(), O_RDWR | O_NOCTTY | O_CLOEXEC), path.data());
    if (::tcgetattr(slave_.get(), &settings_) != 0) fail("pseudo-terminal");
    ::cfmakeraw(&settings_);
    if (::tcsetattr(slave_.get(), TCSANOW, &settings_) != 0) fail("pseudo-terminal");
    port_ = path.data();
    if (!options_.link.empty()) {
      std::filesystem::remove(options_.link);
      std::filesystem::create_symlink(port_, options_.link);
      port_ = options_.link.string();
    }
    thread_ = std::thread([this] { run(); });
  }

  ~Line() {
    stopping_ = true;
    const std::uint64_t one = 1;
    [[maybe_unused]] const auto written = ::write(wake_.get(), &one, sizeof one);
    thread_.join();
    if (!options_.link.empty()) {
      std::error_code ignored;
      std::filesystem::remove(options_.link, ignored);
    }
  }

  Units& units() { return units_; }
  const std::string& port() const { return port_; }
  const WireLog& log() const { return log_; }

 private:
  static constexpr int kIdleLook_ms = 100;

  struct Late {
    Host::time_point due;
    Bytes frame;
  };

  void run() {
    while (!stopping_) {
      std::array<pollfd, 2> watched{pollfd{master_.get(), POLLIN, 0},
                                    pollfd{wake_.get(), POLLIN, 0}};
      ::poll(watched.data(), watched.size(), patience_ms());
      if ((watched[0].revents & POLLIN) != 0) take();
      if (!pending_.empty() && Host::now() - last_byte_ >= kFrameEnds) silence();
      deliver_late();
      take_back_speed();
    }
  }

  /// A master that was killed leaves its speed behind. The next one asks for the same and for a
  /// parity, which a pseudo-terminal does not have; the C library takes a request of which nothing
  /// is done for an error. The speed means nothing here, so one of our own is kept.
  void take_back_speed() {
    termios now{};
    if (::tcgetattr(slave_.get(), &now) != 0) return;
    if (::cfgetospeed(&now) != ::cfgetospeed(&settings_)) {
      ::tcsetattr(slave_.get(), TCSANOW, &settings_);
    }
  }

  int patience_ms() const {
    auto next = Host::time_point::max();
    if (!pending_.empty()) next = last_byte_ + kFrameEnds;
    for (const Late& late : late_) next = std::min(next, late.due);
    if (next == Host::time_point::max()) return kIdleLook_ms;
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(next - Host::now()).count();
    return static_cast<int>(std::clamp<std::int64_t>(left, 0, 1000));
  }

  void take() {
    std::array<std::uint8_t, 512> bytes{};
    const auto count = ::read(master_.get(), bytes.data(), bytes.size());
    if (count <= 0) return;
    last_byte_ = Host::now();
    if (pending_.empty()) first_byte_ = last_byte_;
    pending_.insert(pending_.end(), bytes.begin(), bytes.begin() + count);
    while (const auto length = rtu_request_length(pending_)) {
      if (pending_.size() < *length) return;
      const Bytes frame(pending_.begin(), pending_.begin() + static_cast<std::ptrdiff_t>(*length));
      pending_.erase(pending_.begin(), pending_.begin() + static_cast<std::ptrdiff_t>(*length));
      handle(frame);
    }
  }

  /// What is there is all there will be: a request of an unknown function, or rubbish.
  void silence() {
    const Bytes frame = std::exchange(pending_, {});
    if (crc_fits(frame)) {
      handle(frame);
    } else {
      log_.add(first_byte_, first_byte_ + line_time(frame.size()));
    }
  }

  void handle(const Bytes& frame) {
    const Host::time_point sent = first_byte_ + line_time(frame.size());
    first_byte_ = Host::now();
    const int unit = frame[0];
    const std::span<const std::uint8_t> pdu(frame.data() + 1, frame.size() - 3);
    Units::Reaction reaction =
        crc_fits(frame) ? units_.react(unit, pdu) : units_.react_to_damage(unit, frame[1]);
    log_.add(sent - line_time(frame.size()), sent);
    if (reaction.delivery == Units::Delivery::none) return;
    Bytes answer = on_the_line(reaction, frame[0]);
    const Host::time_point begins = sent + line_time(7) / 2;
    const Host::time_point arrived = begins + line_time(answer.size());
    if (reaction.delivery == Units::Delivery::late) {
      late_.push_back({arrived + options_.late_by, std::move(answer)});
      return;
    }
    std::this_thread::sleep_until(arrived);
    log_.add(begins, arrived);
    put(answer);
  }

  static Bytes on_the_line(const Units::Reaction& reaction, std::uint8_t unit) {
    using Delivery = Units::Delivery;
    Bytes frame{unit};
    frame.insert(frame.end(), reaction.pdu.begin(), reaction.pdu.end());
    if (reaction.delivery == Delivery::of_another_unit) {
      frame[0] = static_cast<std::uint8_t>(unit % 247 + 1);
    }
    // Of another address for a write, of another length for a read.
    if (reaction.delivery == Delivery::to_another_request && frame.size() > 3) {
      if (frame[1] <= 0x04) {
        frame[2] = static_cast<std::uint8_t>(frame[2] + 2);
        frame.insert(frame.end(), {0, 0});
      } else {
        frame[3] = static_cast<std::uint8_t>(frame[3] ^ 1U);
      }
    }
    frame = with_crc(std::move(frame));
    if (reaction.delivery == Delivery::damaged) frame.back() ^= 0x5AU;
    if (reaction.delivery == Delivery::torn) frame.resize(frame.size() / 2);
    return frame;
  }

  void deliver_late() {
    const auto now = Host::now();
    for (const Late& late : late_) {
      if (late.due <= now) put(late.frame);
    }
    std::erase_if(late_, [&](const Late& late) { return late.due <= now; });
  }

  void put(const Bytes& frame) {
    // A master that does not read loses what it does not read, as on a real line.
    [[maybe_unused]] const auto written = ::write(master_.get(), frame.data(), frame.size());
  }

  std::chrono::nanoseconds line_time(std::size_t characters) const {
    const int bits = 1 + 8 + (options_.parity == 'N' ? 0 : 1) + options_.stop_bits;
    return std::chrono::nanoseconds(static_cast<std::int64_t>(characters) * bits * 1'000'000'000 /
                                    options_.baud);
  }

  Options options_;
  Units units_;
  WireLog log_;
  Descriptor master_;
  termios settings_{};  ///< of a line nobody has set up
  Descriptor slave_;
  Descriptor wake_;
  std::string port_;
  std::atomic<bool> stopping_ = false;
  // The thread's own:
  Bytes pending_;
  Host::time_point first_byte_{};
  Host::time_point last_byte_{};
  std::vector<Late> late_;
  std::thread thread_;
};

ModbusRtuLine::ModbusRtuLine(const Options& options, Faults faults, const devices::Clock& clock)
    : line_(std::make_unique<Line>(options, std::move(faults), clock)) {}
ModbusRtuLine::~ModbusRtuLine() = default;

void ModbusRtuLine::add(int unit, std::unique_ptr<RegisterDevice> device) {
  line_->units().add(unit, std::move(device));
}
const std::string& ModbusRtuLine::port() const { return line_->port(); }
const WireLog& ModbusRtuLine::wire_log() const { return line_->log(); }

}  // namespace gonio::modbus_emulator
