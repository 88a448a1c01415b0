#include "gonio/parallel/parallel.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <cstddef>
#include <latch>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

namespace gonio::parallel {
namespace {

using ::testing::Each;
using ::testing::ElementsAre;

/// Every test starts from the default thread count and leaves it behind.
class Parallel : public ::testing::Test {
 protected:
  void SetUp() override { set_thread_count(0); }
  void TearDown() override { set_thread_count(0); }
};

/// A sum whose last bits depend on the order of additions.
double order_sensitive_sum(std::size_t items, std::size_t block) {
  return reduce_blocks(
      std::size_t{0}, items, block, 0.0,
      [](std::size_t from, std::size_t to) {
        double sum = 0.0;
        for (std::size_t i = from; i < to; ++i) sum += 1.0 / (1.0 + static_cast<double>(i));
        return sum;
      },
      [](double& total, double part) { total += part; });
}

TEST_F(Parallel, VisitsEveryItemOnce) {
  set_thread_count(4);
  std::vector<int> visits(10'007, 0);
  for_each_block(0, visits.size(), 64, [&](std::size_t from, std::size_t to) {
    for (std::size_t i = from; i < to; ++i) ++visits[i];
  });
  EXPECT_THAT(visits, Each(1));
}

TEST_F(Parallel, CutsTheSameBlocksWhateverTheThreadCount) {
  for (const unsigned threads : {1U, 3U}) {
    set_thread_count(threads);
    std::vector<std::pair<std::size_t, std::size_t>> blocks(3);
    for_each_block(5, 30, 10, [&](std::size_t from, std::size_t to) {
      blocks[(from - 5) / 10] = {from, to};
    });
    EXPECT_THAT(blocks, ElementsAre(std::pair(5, 15), std::pair(15, 25), std::pair(25, 30)));
  }
}

TEST_F(Parallel, DoesNothingForAnEmptyRange) {
  for_each_block(7, 7, 10, [](std::size_t, std::size_t) { FAIL(); });
  EXPECT_EQ(order_sensitive_sum(0, 10), 0.0);
}

TEST_F(Parallel, RefusesBlocksWithoutItems) {
  EXPECT_THROW(for_each_block(0, 1, 0, [](std::size_t, std::size_t) {}), std::invalid_argument);
}

TEST_F(Parallel, SumsToTheSameBytesWithAnyThreadCount) {
  set_thread_count(1);
  const double alone = order_sensitive_sum(100'000, 37);
  for (const unsigned threads : {2U, 3U, 8U}) {
    set_thread_count(threads);
    for (int repeat = 0; repeat < 20; ++repeat) {
      EXPECT_EQ(order_sensitive_sum(100'000, 37), alone) << threads << " threads";
    }
  }
}

TEST_F(Parallel, CombinesPartsInBlockOrder) {
  set_thread_count(4);
  const auto order = reduce_blocks(
      std::size_t{0}, std::size_t{500}, std::size_t{1}, std::vector<std::size_t>{},
      [](std::size_t from, std::size_t) { return std::vector{from}; },
      [](std::vector<std::size_t>& total, std::vector<std::size_t>&& part) {
        total.insert(total.end(), part.begin(), part.end());
      });
  ASSERT_EQ(order.size(), 500U);
  for (std::size_t i = 0; i < order.size(); ++i) EXPECT_EQ(order[i], i);
}

TEST_F(Parallel, UsesAsManyThreadsAsAsked) {
  set_thread_count(3);
  EXPECT_EQ(thread_count(), 3U);
  // Each of three blocks waits for the two others: this ends only if three threads are at work.
  std::latch all_here(3);
  for_each_block(0, 3, 1, [&](std::size_t, std::size_t) { all_here.arrive_and_wait(); });
}

TEST_F(Parallel, TakesOneThreadPerProcessorByDefault) {
  EXPECT_EQ(thread_count(), std::max(1U, std::thread::hardware_concurrency()));
}

TEST_F(Parallel, RethrowsWhatTheFirstFailingBlockHasThrown) {
  for (const unsigned threads : {1U, 2U, 4U}) {
    set_thread_count(threads);
    for (int repeat = 0; repeat < 50; ++repeat) {
      try {
        for_each_block(0, 100, 1, [](std::size_t from, std::size_t) {
          if (from >= 40) throw std::runtime_error("block " + std::to_string(from));
        });
        FAIL() << "nothing was thrown";
      } catch (const std::runtime_error& error) {
        EXPECT_STREQ(error.what(), "block 40");
      }
    }
  }
}

TEST_F(Parallel, WorksAgainAfterAFailure) {
  set_thread_count(2);
  const auto fail = [](std::size_t, std::size_t) { throw std::runtime_error("broken"); };
  EXPECT_THROW(for_each_block(0, 10, 1, fail), std::runtime_error);
  std::atomic<int> calls = 0;
  for_each_block(0, 10, 1, [&](std::size_t, std::size_t) { ++calls; });
  EXPECT_EQ(calls, 10);
}

TEST_F(Parallel, RethrowsAFailureToCombine) {
  set_thread_count(2);
  const auto reduce = [] {
    return reduce_blocks(
        std::size_t{0}, std::size_t{100}, std::size_t{1}, 0,
        [](std::size_t, std::size_t) { return 1; },
        [](int&, int) { throw std::runtime_error("cannot add"); });
  };
  EXPECT_THROW(reduce(), std::runtime_error);
}

TEST_F(Parallel, RunsLoopsInsideLoops) {
  set_thread_count(2);
  std::vector<double> sums(8);
  for_each_block(0, sums.size(), 1, [&](std::size_t from, std::size_t) {
    sums[from] = order_sensitive_sum(1000, 10);
  });
  EXPECT_THAT(sums, Each(order_sensitive_sum(1000, 10)));
}

TEST_F(Parallel, ServesSeveralCallingThreads) {
  set_thread_count(2);
  const double expected = order_sensitive_sum(10'000, 100);
  std::vector<double> sums(4);
  {
    std::vector<std::jthread> callers;
    callers.reserve(sums.size());
    for (double& sum : sums) {
      callers.emplace_back([&sum] { sum = order_sensitive_sum(10'000, 100); });
    }
  }
  EXPECT_THAT(sums, Each(expected));
}

TEST_F(Parallel, RefusesToChangeTheThreadCountInsideALoop) {
  for (const unsigned threads : {1U, 2U}) {
    set_thread_count(threads);
    const auto change = [](std::size_t, std::size_t) { set_thread_count(5); };
    EXPECT_THROW(for_each_block(0, 2, 1, change), std::logic_error);
  }
}

}  // namespace
}  // namespace gonio::parallel
