#include "host_names.h"

#include <arpa/inet.h>
#include <strings.h>

#include <array>
#include <charconv>
#include <cstring>

namespace gonio::monitor {
namespace {

constexpr std::uint16_t kHttpPort = 80;

bool same_name(const std::string& one, const std::string& other) {
  return ::strcasecmp(one.c_str(), other.c_str()) == 0;
}

}  // namespace

bool is_literal(const std::string& address) {
  std::array<unsigned char, sizeof(in6_addr)> bytes{};
  return ::inet_pton(AF_INET, address.c_str(), bytes.data()) == 1 ||
         ::inet_pton(AF_INET6, address.c_str(), bytes.data()) == 1;
}

bool is_loopback_literal(const std::string& address) {
  in_addr four{};
  if (::inet_pton(AF_INET, address.c_str(), &four) == 1) return ntohl(four.s_addr) >> 24 == 127;
  in6_addr six{};
  return ::inet_pton(AF_INET6, address.c_str(), &six) == 1 &&
         std::memcmp(&six, &in6addr_loopback, sizeof six) == 0;
}

bool is_own_host(std::string_view host, const std::string& address, std::uint16_t port,
                 const std::string& machine) {
  if (host.find('\0') != std::string_view::npos) return false;
  std::string name;
  std::string_view rest;
  if (host.starts_with('[')) {
    const std::size_t end = host.find(']');
    if (end == std::string_view::npos) return false;
    name = host.substr(1, end - 1);
    rest = host.substr(end + 1);
  } else {
    const std::size_t end = std::min(host.find(':'), host.size());
    name = host.substr(0, end);
    rest = host.substr(end);
  }
  std::uint16_t named_port = kHttpPort;
  if (!rest.empty()) {
    const char* const last = rest.data() + rest.size();
    const auto [end, error] = std::from_chars(rest.data() + 1, last, named_port);
    if (rest[0] != ':' || error != std::errc() || end != last) return false;
  }
  if (named_port != port) return false;
  if (is_loopback_literal(name) || same_name(name, "localhost")) return true;
  if (is_loopback_literal(address)) return false;
  return is_literal(name) || (!machine.empty() && same_name(name, machine));
}

}  // namespace gonio::monitor
