#include "line_turn.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <future>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

namespace gonio::modbus_bus {
namespace {

TEST(LineTurn, UrgentOneGoesBeforeThoseThatWaitedLonger) {
  LineTurn turn;
  std::mutex mutex;
  std::vector<std::string> order;
  const auto note = [&](const char* who) {
    const std::lock_guard lock(mutex);
    order.emplace_back(who);
  };
  std::vector<std::thread> others;
  {
    const auto hold = turn.take(false);
    for (int i = 0; i < 2; ++i) {
      others.emplace_back([&] {
        const auto mine = turn.take(false);
        note("normal");
      });
    }
    others.emplace_back([&] {
      const auto mine = turn.take(true);
      note("urgent");
    });
    while (!turn.urgent_waits()) std::this_thread::yield();
  }
  for (std::thread& each : others) each.join();
  EXPECT_THAT(order, testing::ElementsAre("urgent", "normal", "normal"));
}

TEST(LineTurn, OneAtATime) {
  LineTurn turn;
  int inside = 0;  // guarded by the turn: a race is found by the thread sanitizer, an overlap here
  int most = 0;
  const auto work = [&](bool urgent) {
    for (int i = 0; i < 500; ++i) {
      const auto hold = turn.take(urgent);
      most = std::max(most, ++inside);
      --inside;
    }
  };
  auto first = std::async(std::launch::async, work, false);
  auto second = std::async(std::launch::async, work, true);
  work(false);
  first.get();
  second.get();
  EXPECT_EQ(most, 1);
  EXPECT_FALSE(turn.urgent_waits());
}

}  // namespace
}  // namespace gonio::modbus_bus
