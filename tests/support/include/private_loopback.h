#pragma once

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace gonio {

/// Gives this process a network of its own in which there is nothing but loopback, with 127.0.0.1
/// and these further addresses: fixed ports are free, and a broadcast reaches nobody else.
///
/// Works as root and, where the kernel lets users make namespaces, as anybody. Before the first
/// thread: only the calling one and those it starts later are moved. Once per process.
/// Returns why it was refused; empty when it worked.
std::string enter_private_loopback(const std::vector<std::string>& further_addresses);

/// For all tests of a program: enters a private loopback, or skips them with the reason.
class PrivateLoopback : public testing::Environment {
 public:
  explicit PrivateLoopback(std::vector<std::string> further_addresses = {})
      : addresses_(std::move(further_addresses)) {}

  void SetUp() override {
    const std::string refused = enter_private_loopback(addresses_);
    if (!refused.empty()) GTEST_SKIP() << "no network of our own: " << refused;
  }

 private:
  std::vector<std::string> addresses_;
};

}  // namespace gonio
