#include "gonio/sim/virtual_clock.h"

#include <gtest/gtest.h>

#include <atomic>
#include <limits>
#include <thread>

namespace gonio::sim {
namespace {

using namespace std::chrono_literals;

TEST(VirtualClock, StartsAtZeroAndMovesOnlyWhenWaitedFor) {
  VirtualClock clock;
  EXPECT_EQ(clock.now(), 0ns);
  clock.wait_until(3h);
  EXPECT_EQ(clock.now(), 3h);
  EXPECT_EQ(clock.now(), 3h);
}

TEST(VirtualClock, NeverGoesBack) {
  VirtualClock clock;
  clock.wait_until(5s);
  clock.wait_until(2s);
  EXPECT_EQ(clock.now(), 5s);
}

TEST(VirtualClock, StaysWhereAnInterruptionFoundIt) {
  VirtualClock clock;
  clock.wait_until(1s);
  EXPECT_FALSE(clock.wait_until(9s, [] { return true; }));
  EXPECT_EQ(clock.now(), 1s);
  EXPECT_TRUE(clock.wait_until(9s, [] { return false; }));
  EXPECT_EQ(clock.now(), 9s);
}

TEST(VirtualClock, PacedWaitTakesVirtualTimeByScale) {
  VirtualClock clock(1000.0);
  const auto start = std::chrono::steady_clock::now();
  clock.wait_until(20s);
  const auto wall = std::chrono::steady_clock::now() - start;
  EXPECT_EQ(clock.now(), 20s);
  EXPECT_GE(wall, 20ms);
  EXPECT_LT(wall, 10s);  // far from the 20 s of a scale that is ignored, also on a busy machine
}

TEST(VirtualClock, PacedWaitCanBeInterruptedFromAnotherThread) {
  VirtualClock clock(1.0);
  std::atomic<bool> stop = false;
  std::thread other([&] {
    while (clock.now() == 0ns) std::this_thread::yield();
    stop = true;
  });
  EXPECT_FALSE(clock.wait_until(1h, [&] { return stop.load(); }));
  other.join();
  EXPECT_GT(clock.now(), 0ns);
  EXPECT_LT(clock.now(), 1h);
}

TEST(VirtualClock, RefusesAScaleThatIsNoPace) {
  EXPECT_THROW(VirtualClock(0.0), std::invalid_argument);
  EXPECT_THROW(VirtualClock(-1.0), std::invalid_argument);
  EXPECT_THROW(VirtualClock(std::numeric_limits<double>::quiet_NaN()), std::invalid_argument);
}

TEST(VirtualClock, RunningOnePassesWithoutAnybodyWaiting) {
  VirtualClock clock(1000.0, VirtualClock::Between::runs);
  const auto start = clock.now();
  const auto wall = std::chrono::steady_clock::now();
  while (std::chrono::steady_clock::now() - wall < 2ms) {
  }
  EXPECT_GE(clock.now() - start, 2s);
}

TEST(VirtualClock, RunningOneWaitsAndIsInterrupted) {
  VirtualClock clock(1000.0, VirtualClock::Between::runs);
  clock.wait_until(clock.now() + 3s);
  EXPECT_GE(clock.now(), 3s);
  EXPECT_FALSE(clock.wait_until(clock.now() + 24h, [] { return true; }));
}

TEST(VirtualClock, RunningOneNeedsAScale) {
  EXPECT_THROW(VirtualClock(std::nullopt, VirtualClock::Between::runs), std::invalid_argument);
}

}  // namespace
}  // namespace gonio::sim
