#include "gonio/monitor/thinned_series.h"

#include <gtest/gtest.h>

namespace gonio::monitor {
namespace {

TEST(ThinnedSeries, KeepsFewOfManyEvenlyWithFirstAndLast) {
  ThinnedSeries series;
  EXPECT_TRUE(series.values().empty());
  constexpr int kMany = 100'000;
  for (int i = 0; i < kMany; ++i) {
    series.add({static_cast<double>(i), -static_cast<double>(i)});
    ASSERT_LE(series.values().size(), ThinnedSeries::kMost + 1);
  }
  const auto values = series.values();
  EXPECT_GE(values.size(), ThinnedSeries::kMost / 2);
  EXPECT_EQ(values.front(), (ThinnedSeries::Value{0.0, 0.0}));
  EXPECT_EQ(values.back(), (ThinnedSeries::Value{kMany - 1.0, 1.0 - kMany}));
  const double step = values[1].at_s - values[0].at_s;
  for (std::size_t i = 2; i + 1 < values.size(); ++i) {
    EXPECT_EQ(values[i].at_s - values[i - 1].at_s, step) << i;
  }
}

TEST(ThinnedSeries, KeepsAllOfFew) {
  ThinnedSeries series;
  for (int i = 0; i < 5; ++i) series.add({static_cast<double>(i), 1.0});
  EXPECT_EQ(series.values().size(), 5U);
}

}  // namespace
}  // namespace gonio::monitor
