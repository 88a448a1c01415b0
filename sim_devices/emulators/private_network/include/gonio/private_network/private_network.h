#pragma once

#include <string>
#include <vector>

namespace gonio::private_network {

/// Gives this process a network of its own in which there is nothing but loopback, with 127.0.0.1
/// and these further 127.x addresses: fixed ports are free, and a broadcast reaches nobody else.
///
/// Works as root and, where the kernel lets users make namespaces, as anybody. Before the first
/// thread: only the calling one, those it starts later, and its children are moved. Once per
/// process. Returns why it was refused; empty when it worked.
std::string enter(const std::vector<std::string>& further_addresses = {});

}  // namespace gonio::private_network
