#include "gonio/modbus_emulator/tcp_server.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <stdexcept>
#include <system_error>
#include <thread>
#include <utility>
#include <vector>

#include "descriptor.h"
#include "gonio/modbus_emulator/frames.h"
#include "units.h"

namespace gonio::modbus_emulator {
namespace {

using TcpHost = std::chrono::steady_clock;

[[noreturn]] void fail_tcp(const char* what) {
  throw std::system_error(errno, std::generic_category(), what);
}

}  // namespace

class ModbusTcpServer::Server {
 public:
  Server(const Options& options, Faults faults, const devices::Clock& clock)
      : options_(options),
        units_(std::move(faults), clock),
        listener_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)),
        wake_(::eventfd(0, EFD_CLOEXEC)) {
    if (listener_.get() < 0 || wake_.get() < 0) fail_tcp("socket");
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(options_.port);
    if (::inet_pton(AF_INET, options_.address.c_str(), &address.sin_addr) != 1) {
      throw std::invalid_argument("address: found " + options_.address + ", expected IPv4");
    }
    const int on = 1;
    ::setsockopt(listener_.get(), SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
    auto* const generic = reinterpret_cast<sockaddr*>(&address);
    socklen_t length = sizeof address;
    if (::bind(listener_.get(), generic, length) != 0) fail_tcp("bind");
    if (::listen(listener_.get(), 16) != 0) fail_tcp("listen");
    if (::getsockname(listener_.get(), generic, &length) != 0) fail_tcp("getsockname");
    port_ = ntohs(address.sin_port);
    thread_ = std::thread([this] { run(); });
  }

  ~Server() {
    stopping_ = true;
    const std::uint64_t one = 1;
    [[maybe_unused]] const auto written = ::write(wake_.get(), &one, sizeof one);
    thread_.join();
  }

  Units& units() { return units_; }
  std::uint16_t port() const { return port_; }
  const WireLog& log() const { return log_; }

 private:
  struct Connection {
    Descriptor socket;
    Bytes pending;
    bool open = true;
  };
  struct Late {
    TcpHost::time_point due;
    int socket;
    Bytes frame;
  };

  void run() {
    while (!stopping_) {
      std::vector<pollfd> watched{{listener_.get(), POLLIN, 0}, {wake_.get(), POLLIN, 0}};
      for (const Connection& each : connections_) watched.push_back({each.socket.get(), POLLIN, 0});
      ::poll(watched.data(), watched.size(), patience_ms());
      for (std::size_t i = 2; i < watched.size(); ++i) {
        if (watched[i].revents != 0) take(connections_[i - 2]);
      }
      deliver_late();
      std::erase_if(connections_, [](const Connection& each) { return !each.open; });
      if (watched[0].revents != 0) welcome();
    }
  }

  int patience_ms() const {
    auto next = TcpHost::time_point::max();
    for (const Late& late : late_) next = std::min(next, late.due);
    if (next == TcpHost::time_point::max()) return -1;
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(next - TcpHost::now()).count();
    return static_cast<int>(std::clamp<std::int64_t>(left, 0, 1000));
  }

  void welcome() {
    Descriptor socket(::accept4(listener_.get(), nullptr, nullptr, SOCK_CLOEXEC));
    if (socket.get() < 0) return;
    const int on = 1;
    ::setsockopt(socket.get(), IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
    connections_.push_back({std::move(socket), {}, true});
  }

  void take(Connection& from) {
    std::array<std::uint8_t, 1024> bytes{};
    const auto count = ::recv(from.socket.get(), bytes.data(), bytes.size(), 0);
    if (count <= 0) return close(from);
    const auto received = TcpHost::now();
    from.pending.insert(from.pending.end(), bytes.begin(), bytes.begin() + count);
    TcpRequest request;
    TcpState state = TcpState::incomplete;
    while ((state = tcp_request(from.pending, request)) == TcpState::whole) {
      from.pending.erase(from.pending.begin(),
                         from.pending.begin() + static_cast<std::ptrdiff_t>(request.length));
      reply(from, request);
      log_.add(received, TcpHost::now());
    }
    if (state == TcpState::broken) close(from);
  }

  void reply(Connection& to, const TcpRequest& request) {
    using Delivery = Units::Delivery;
    const Units::Reaction reaction = units_.react(request.unit, request.pdu);
    if (reaction.delivery == Delivery::none) return;
    std::uint16_t transaction = request.transaction;
    std::uint8_t unit = request.unit;
    if (reaction.delivery == Delivery::to_another_request) --transaction;
    if (reaction.delivery == Delivery::of_another_unit) unit = static_cast<std::uint8_t>(unit + 1);
    Bytes frame = tcp_frame(transaction, unit, reaction.pdu);
    if (reaction.delivery == Delivery::torn) frame.resize(frame.size() / 2);
    if (reaction.delivery == Delivery::late) {
      late_.push_back({TcpHost::now() + options_.late_by, to.socket.get(), std::move(frame)});
    } else {
      send(to.socket.get(), frame);
    }
  }

  void close(Connection& connection) {
    connection.open = false;
    // Its number may soon belong to another connection.
    std::erase_if(late_, [&](const Late& late) { return late.socket == connection.socket.get(); });
  }

  void deliver_late() {
    const auto now = TcpHost::now();
    for (const Late& late : late_) {
      if (late.due <= now) send(late.socket, late.frame);
    }
    std::erase_if(late_, [&](const Late& late) { return late.due <= now; });
  }

  static void send(int socket, const Bytes& frame) {
    [[maybe_unused]] const auto sent =
        ::send(socket, frame.data(), frame.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
  }

  Options options_;
  Units units_;
  WireLog log_;
  Descriptor listener_;
  Descriptor wake_;
  std::uint16_t port_ = 0;
  std::atomic<bool> stopping_ = false;
  // The thread's own:
  std::vector<Connection> connections_;
  std::vector<Late> late_;
  std::thread thread_;
};

ModbusTcpServer::ModbusTcpServer(const Options& options, Faults faults, const devices::Clock& clock)
    : server_(std::make_unique<Server>(options, std::move(faults), clock)) {}
ModbusTcpServer::~ModbusTcpServer() = default;

void ModbusTcpServer::add(int unit, std::unique_ptr<RegisterDevice> device) {
  server_->units().add(unit, std::move(device));
}
std::uint16_t ModbusTcpServer::port() const { return server_->port(); }
const WireLog& ModbusTcpServer::wire_log() const { return server_->log(); }

}  // namespace gonio::modbus_emulator
