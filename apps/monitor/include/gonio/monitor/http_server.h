#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>

namespace gonio::monitor {

/// Where a server listens. Port 0: any that is free.
struct HttpAddress {
  std::string address = "127.0.0.1";  ///< a literal, IPv4 or IPv6
  std::uint16_t port = 0;

  /// Throws std::invalid_argument unless `address` is a literal.
  bool is_loopback() const;
};

/// What a server grants one client and all of them together.
struct HttpLimits {
  unsigned connections = 32;                ///< more wait in the kernel's queue
  std::size_t header_bytes = 16 * 1024;     ///< of one request; no request may have a body
  std::chrono::milliseconds silence{5000};  ///< a client that neither sends nor takes is dropped
  std::chrono::milliseconds whole{10000};   ///< and so is one that is not done by then
};

struct HttpRequest {
  std::string method;  ///< "GET" or "POST"
  std::string path;    ///< percent-decoded, without what follows '?'
  std::map<std::string, std::string> query;
  std::map<std::string, std::string> headers;  ///< names in lower case
};

struct HttpReply {
  int status = 200;
  std::string content_type = "text/plain; charset=utf-8";
  std::string body;
};

/// A small web server for one machine's own pages: GET and POST without bodies, one request per
/// connection. Everything a stranger could ask for is bounded (HttpLimits), so that the worst it
/// can do is to keep others from the page.
///
/// Refused    Before the handler sees it: another Host than this server's own address (a name that
///            somebody else's DNS points here would let his page read ours), a POST from another
///            origin, a body, other methods. On a loopback address only loopback names are its own;
///            elsewhere any literal and this machine's name, with the right port.
/// Headers    Every reply forbids what the page does not need: scripts, styles, pictures and
///            connections from elsewhere, frames, caches.
/// State      Serves from construction to destruction, which waits for the reply under way only.
/// Threads    The handler is called on the server's one thread, which has a lower priority than
///            the program's.
/// Errors     std::system_error naming address and port when it cannot listen. What the handler
///            throws becomes status 500.
class HttpServer {
 public:
  using Handler = std::function<HttpReply(const HttpRequest&)>;

  HttpServer(const HttpAddress& address, Handler handler, HttpLimits limits = {});
  ~HttpServer();
  HttpServer(const HttpServer&) = delete;
  HttpServer& operator=(const HttpServer&) = delete;

  std::uint16_t port() const;
  /// "http://127.0.0.1:8760/"; with the machine's name where it listens on all its addresses.
  std::string url() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace gonio::monitor
