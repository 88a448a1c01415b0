#include "host_names.h"

#include <gtest/gtest.h>

namespace gonio::monitor {
namespace {

TEST(OwnHost, ElsewhereIsAnyLiteralAndTheMachinesNameButNoOther) {
  const std::string everywhere = "0.0.0.0";
  EXPECT_TRUE(is_own_host("192.168.1.5:8760", everywhere, 8760, "bench"));
  EXPECT_TRUE(is_own_host("[fe80::1]:8760", everywhere, 8760, "bench"));
  EXPECT_TRUE(is_own_host("bench:8760", everywhere, 8760, "bench"));
  EXPECT_TRUE(is_own_host("Bench:8760", everywhere, 8760, "bench"));
  EXPECT_FALSE(is_own_host("evil.example:8760", everywhere, 8760, "bench"));
  EXPECT_FALSE(is_own_host(":8760", everywhere, 8760, "")) << "a machine without a name";
}

TEST(OwnHost, NeedsThePort) {
  EXPECT_TRUE(is_own_host("localhost", "127.0.0.1", 80, ""));
  EXPECT_FALSE(is_own_host("localhost", "127.0.0.1", 8760, ""));
  for (const char* wrong : {"localhost:", "localhost:87600", "localhost:8760x", "localhost:+8760",
                            "localhost: 8760", "[::1]8760"}) {
    EXPECT_FALSE(is_own_host(wrong, "127.0.0.1", 8760, "")) << wrong;
  }
}

}  // namespace
}  // namespace gonio::monitor
