#include "gonio/monitor/http_server.h"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <microhttpd.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cerrno>
#include <climits>
#include <cstring>
#include <exception>
#include <stdexcept>
#include <system_error>
#include <thread>

#include "descriptor.h"
#include "host_names.h"

namespace gonio::monitor {
namespace {

using Clock = std::chrono::steady_clock;

constexpr int kBacklog = 64;
constexpr int kNiceness = 10;
constexpr int kLongestWait_ms = 500;  // how late a client that is over its time may be dropped

constexpr std::chrono::milliseconds kLastWords{100};

constexpr const char* kContentPolicy =
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self'; connect-src 'self'; "
    "base-uri 'none'; form-action 'none'; frame-ancestors 'none'";
constexpr std::array<std::pair<const char*, const char*>, 7> kHeaders = {{
    {"Content-Security-Policy", kContentPolicy},
    {"X-Content-Type-Options", "nosniff"},
    {"Cross-Origin-Resource-Policy", "same-origin"},
    {"Cross-Origin-Opener-Policy", "same-origin"},
    {"Referrer-Policy", "no-referrer"},
    {"Cache-Control", "no-store"},
    {"Connection", "close"},
}};

std::string in_url(const std::string& address) {
  return address.find(':') == std::string::npos ? address : "[" + address + "]";
}

[[noreturn]] void cannot_listen(const HttpAddress& address, int error) {
  throw std::system_error(
      error, std::generic_category(),
      fmt::format("cannot listen on {}:{}", in_url(address.address), address.port));
}

int listening_socket(const HttpAddress& address) {
  sockaddr_storage bound{};
  socklen_t length = 0;
  auto* four = reinterpret_cast<sockaddr_in*>(&bound);
  auto* six = reinterpret_cast<sockaddr_in6*>(&bound);
  if (::inet_pton(AF_INET, address.address.c_str(), &four->sin_addr) == 1) {
    four->sin_family = AF_INET;
    four->sin_port = htons(address.port);
    length = sizeof *four;
  } else if (::inet_pton(AF_INET6, address.address.c_str(), &six->sin6_addr) == 1) {
    six->sin6_family = AF_INET6;
    six->sin6_port = htons(address.port);
    length = sizeof *six;
  } else {
    throw std::invalid_argument("address: found \"" + address.address +
                                "\", expected a numeric IP address");
  }
  Descriptor socket(
      ::socket(bound.ss_family, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, IPPROTO_TCP));
  if (socket.get() < 0) cannot_listen(address, errno);
  const int yes = 1;
  ::setsockopt(socket.get(), SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
  if (::bind(socket.get(), reinterpret_cast<const sockaddr*>(&bound), length) != 0 ||
      ::listen(socket.get(), kBacklog) != 0) {
    cannot_listen(address, errno);
  }
  return socket.release();
}

std::uint16_t port_of(int socket) {
  sockaddr_storage bound{};
  socklen_t length = sizeof bound;
  if (::getsockname(socket, reinterpret_cast<sockaddr*>(&bound), &length) != 0) {
    throw std::system_error(errno, std::generic_category(), "getsockname");
  }
  return ntohs(bound.ss_family == AF_INET6
                   ? reinterpret_cast<const sockaddr_in6*>(&bound)->sin6_port
                   : reinterpret_cast<const sockaddr_in*>(&bound)->sin_port);
}

std::string machine_name() {
  std::array<char, HOST_NAME_MAX + 1> name{};
  return ::gethostname(name.data(), name.size() - 1) == 0 ? name.data() : "";
}

struct DestroyResponse {
  void operator()(MHD_Response* response) const noexcept { MHD_destroy_response(response); }
};

MHD_Result send(MHD_Connection* connection, const HttpReply& reply) {
  // Copied: the handler may give the next client another body while this one is still being sent.
  const std::unique_ptr<MHD_Response, DestroyResponse> response(MHD_create_response_from_buffer(
      reply.body.size(), const_cast<char*>(reply.body.data()), MHD_RESPMEM_MUST_COPY));
  if (!response) return MHD_NO;
  for (const auto& [name, value] : kHeaders) {
    MHD_add_response_header(response.get(), name, value);
  }
  MHD_add_response_header(response.get(), MHD_HTTP_HEADER_CONTENT_TYPE, reply.content_type.c_str());
  if (reply.status == MHD_HTTP_METHOD_NOT_ALLOWED) {
    MHD_add_response_header(response.get(), MHD_HTTP_HEADER_ALLOW, "GET, POST");
  }
  return MHD_queue_response(connection, static_cast<unsigned>(reply.status), response.get());
}

MHD_Result keep(void* cls, MHD_ValueKind kind, const char* key, const char* value) {
  std::string name(key);
  if (kind == MHD_HEADER_KIND) {
    std::transform(name.begin(), name.end(), name.begin(),
                   [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  }
  static_cast<std::map<std::string, std::string>*>(cls)->insert_or_assign(
      name, value == nullptr ? "" : value);
  return MHD_YES;
}

std::string header(const HttpRequest& request, const char* name) {
  const auto found = request.headers.find(name);
  return found == request.headers.end() ? std::string() : found->second;
}

}  // namespace

bool HttpAddress::is_loopback() const {
  if (!is_literal(address)) {
    throw std::invalid_argument("address: found \"" + address +
                                "\", expected a numeric IP address");
  }
  return is_loopback_literal(address);
}

struct HttpServer::State {
  State(const HttpAddress& where, Handler what, HttpLimits how)
      : address(where), handler(std::move(what)), limits(how), machine(machine_name()) {
    Descriptor socket(listening_socket(address));
    address.port = port_of(socket.get());
    unsigned flags = MHD_USE_EPOLL;
    if (address.address.find(':') != std::string::npos) flags |= MHD_USE_IPv6;
    daemon.reset(MHD_start_daemon(
        flags, 0, nullptr, nullptr, &State::answer, this, MHD_OPTION_LISTEN_SOCKET, socket.get(),
        MHD_OPTION_CONNECTION_LIMIT, limits.connections, MHD_OPTION_CONNECTION_MEMORY_LIMIT,
        limits.header_bytes, MHD_OPTION_CONNECTION_TIMEOUT,
        static_cast<unsigned>((limits.silence.count() + 999) / 1000), MHD_OPTION_NOTIFY_CONNECTION,
        &State::connection_changed, this, MHD_OPTION_EXTERNAL_LOGGER, &State::say_nothing, nullptr,
        MHD_OPTION_END));
    if (!daemon) throw std::runtime_error("the web server does not start");
    socket.release();  // the daemon's now
    if (wake.get() < 0) throw std::system_error(errno, std::generic_category(), "eventfd");
    thread = std::jthread([this](const std::stop_token& stop) { serve(stop); });
  }

  ~State() {
    if (!thread.joinable()) return;
    thread.request_stop();
    const std::uint64_t one = 1;
    [[maybe_unused]] const ssize_t written = ::write(wake.get(), &one, sizeof one);
    thread.join();
  }

  void serve(const std::stop_token& stop) {
    // The session comes first. On Linux a priority set by a thread's number is that thread's only.
    ::setpriority(PRIO_PROCESS, static_cast<id_t>(::syscall(SYS_gettid)), kNiceness);
    const int epoll = MHD_get_daemon_info(daemon.get(), MHD_DAEMON_INFO_EPOLL_FD)->epoll_fd;
    while (!stop.stop_requested()) {
      int wait_ms = kLongestWait_ms;
      MHD_UNSIGNED_LONG_LONG wanted_ms = 0;
      if (MHD_get_timeout(daemon.get(), &wanted_ms) == MHD_YES) {
        wait_ms = static_cast<int>(std::min<MHD_UNSIGNED_LONG_LONG>(wanted_ms, kLongestWait_ms));
      }
      std::array<pollfd, 2> ready{{{epoll, POLLIN, 0}, {wake.get(), POLLIN, 0}}};
      ::poll(ready.data(), ready.size(), wait_ms);
      MHD_run(daemon.get());
      drop_the_slow();
    }
    // What has been answered already should also arrive.
    const Clock::time_point end = Clock::now() + kLastWords;
    while (!connected.empty() && Clock::now() < end) {
      pollfd ready{epoll, POLLIN, 0};
      ::poll(&ready, 1, 10);
      MHD_run(daemon.get());
    }
  }

  /// The library's own time limit starts anew with every byte, so that a client could stay forever.
  void drop_the_slow() {
    const Clock::time_point now = Clock::now();
    for (const auto& [socket, since] : connected) {
      if (now - since > limits.whole) ::shutdown(socket, SHUT_RDWR);
    }
  }

  static void connection_changed(void* cls, MHD_Connection* connection, void** /*context*/,
                                 MHD_ConnectionNotificationCode code) {
    auto& state = *static_cast<State*>(cls);
    const int socket =
        MHD_get_connection_info(connection, MHD_CONNECTION_INFO_CONNECTION_FD)->connect_fd;
    if (code == MHD_CONNECTION_NOTIFY_STARTED) {
      state.connected.insert_or_assign(socket, Clock::now());
    } else {
      state.connected.erase(socket);
    }
  }

  static void say_nothing(void* /*cls*/, const char* /*format*/, va_list /*arguments*/) {}

  static MHD_Result answer(void* cls, MHD_Connection* connection, const char* url,
                           const char* method, const char* /*version*/, const char* /*upload*/,
                           std::size_t* upload_size, void** /*context*/) {
    if (*upload_size != 0) return MHD_NO;
    try {
      auto& state = *static_cast<State*>(cls);
      HttpRequest request{method, url, {}, {}};
      MHD_get_connection_values(connection, MHD_HEADER_KIND, &keep, &request.headers);
      MHD_get_connection_values(connection, MHD_GET_ARGUMENT_KIND, &keep, &request.query);
      return send(connection, state.reply_to(request));
    } catch (const std::exception&) {
      return MHD_NO;  // out of memory: this client goes without
    }
  }

  HttpReply reply_to(const HttpRequest& request) const {
    const std::string host = header(request, "host");
    if (!is_own_host(host, address.address, address.port, machine)) {
      return {MHD_HTTP_MISDIRECTED_REQUEST, "text/plain; charset=utf-8",
              "Host: not the address of this page\n"};
    }
    if (request.method != "GET" && request.method != "POST") {
      return {MHD_HTTP_METHOD_NOT_ALLOWED, "text/plain; charset=utf-8", "expected GET or POST\n"};
    }
    const std::string length = header(request, "content-length");
    if ((!length.empty() && length != "0") || request.headers.contains("transfer-encoding")) {
      return {MHD_HTTP_CONTENT_TOO_LARGE, "text/plain; charset=utf-8",
              "expected a request without a body\n"};
    }
    const std::string origin = header(request, "origin");
    if (request.method == "POST" && !origin.empty() && origin != "http://" + host) {
      return {MHD_HTTP_FORBIDDEN, "text/plain; charset=utf-8", "Origin: another page's\n"};
    }
    try {
      return handler(request);
    } catch (const std::exception&) {
      // What it says is for the program's user, not for whoever has asked.
      return {MHD_HTTP_INTERNAL_SERVER_ERROR, "text/plain; charset=utf-8", "failed\n"};
    }
  }

  HttpAddress address;
  Handler handler;
  HttpLimits limits;
  std::string machine;
  Descriptor wake{::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)};
  std::map<int, Clock::time_point> connected;  ///< by socket, since when; the server's thread only
  std::unique_ptr<MHD_Daemon, void (*)(MHD_Daemon*)> daemon{nullptr, &MHD_stop_daemon};
  std::jthread thread;
};

HttpServer::HttpServer(const HttpAddress& address, Handler handler, HttpLimits limits)
    : state_(std::make_unique<State>(address, std::move(handler), limits)) {}

HttpServer::~HttpServer() = default;

std::uint16_t HttpServer::port() const { return state_->address.port; }

std::string HttpServer::url() const {
  const std::string& address = state_->address.address;
  const bool everywhere = address == "0.0.0.0" || address == "::";
  return fmt::format("http://{}:{}/",
                     everywhere && !state_->machine.empty() ? state_->machine : in_url(address),
                     state_->address.port);
}

}  // namespace gonio::monitor
