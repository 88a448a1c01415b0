#include "gonio/devices/home_count.h"

#include <gtest/gtest.h>

#include <cmath>

namespace gonio::devices {
namespace {

using namespace std::chrono_literals;

/// A drive that stood at 100, goes to `mark` at 500 counts per second and is read every 10 ms.
HomeCount search_for(double mark, HomeCount::Time* found_by) {
  HomeCount count(100.0);
  HomeCount::Time now = 0ms;
  const double direction = mark > 100.0 ? 1.0 : -1.0;
  for (double at = 100.0; direction * (mark - at) > 0.0; at += direction * 5.0) {
    count.searching(at, now);
    now += 10ms;
  }
  *found_by = now;
  return count;
}

TEST(HomeCount, TheMarkIsBetweenTheLastReadingAndAsFarAsItMayHaveGot) {
  for (const double mark : {402.0, 398.0, -98.0}) {
    SCOPED_TRACE(mark);
    HomeCount::Time found_by{};
    HomeCount count = search_for(mark, &found_by);
    count.searches_no_more(found_by);
    count.searches_no_more(found_by + 1s);  // settling
    const auto way = count.way_to_mark();
    ASSERT_TRUE(way);
    EXPECT_NEAR(way->counts, mark - 100.0, way->within);
    EXPECT_NEAR(way->within, 2.5 + 1.0, 1e-9);  // half of what lies between two readings; rounding
  }
}

TEST(HomeCount, ALateAnswerWidensIt) {
  HomeCount::Time found_by{};
  HomeCount count = search_for(402.0, &found_by);
  count.searches_no_more(found_by + 90ms);
  EXPECT_NEAR(count.way_to_mark().value().within, 25.0 + 1.0, 1e-9);
}

TEST(HomeCount, ASearchThatTurnedRoundMayHaveTurnedOnceMore) {
  HomeCount count(0.0);
  const double read[] = {30.0, 20.0, 10.0, 20.0};
  for (int i = 0; i < 4; ++i) count.searching(read[i], 10ms * i);
  count.searches_no_more(40ms);
  const auto way = count.way_to_mark();
  ASSERT_TRUE(way);
  EXPECT_NEAR(way->counts, 20.0, 1e-9);
  EXPECT_NEAR(way->within, 10.0 + 1.0, 1e-9);
}

TEST(HomeCount, TellsNothingOfASearchThatWasReadTooSeldomOrHasNotEnded) {
  HomeCount count(0.0);
  for (int i = 0; i < 3; ++i) count.searching(i, 10ms * i);
  count.searches_no_more(40ms);
  EXPECT_FALSE(count.way_to_mark());
  count.searching(4.0, 50ms);
  EXPECT_FALSE(count.way_to_mark());
  count.searches_no_more(60ms);
  EXPECT_TRUE(count.way_to_mark());
}

}  // namespace
}  // namespace gonio::devices
