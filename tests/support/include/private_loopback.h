#pragma once

#include <gtest/gtest.h>

#include <string>
#include <utility>
#include <vector>

#include "gonio/private_network/private_network.h"

namespace gonio {

/// For all tests of a program: enters a private loopback, or skips them with the reason.
class PrivateLoopback : public testing::Environment {
 public:
  explicit PrivateLoopback(std::vector<std::string> further_addresses = {})
      : addresses_(std::move(further_addresses)) {}

  void SetUp() override {
    const std::string refused = private_network::enter(addresses_);
    if (!refused.empty()) GTEST_SKIP() << "no network of our own: " << refused;
  }

 private:
  std::vector<std::string> addresses_;
};

}  // namespace gonio
