#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace gonio::monitor {

/// A numeric IP address.
bool is_literal(const std::string& address);
/// 127.0.0.0/8 or ::1.
bool is_loopback_literal(const std::string& address);

/// Whether a Host header names the server at `address` and `port`; `machine` is this computer's own
/// name. Names without a port mean port 80.
bool is_own_host(std::string_view host, const std::string& address, std::uint16_t port,
                 const std::string& machine);

}  // namespace gonio::monitor
