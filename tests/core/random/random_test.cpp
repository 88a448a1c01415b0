#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numeric>
#include <set>
#include <stdexcept>
#include <vector>

#include "gonio/random/distributions.h"
#include "gonio/random/key.h"
#include "gonio/random/philox.h"
#include "gonio/random/stream.h"

namespace gonio::random {
namespace {

using ::testing::ElementsAre;

constexpr std::size_t kDraws = 200'000;

/// Statistics of a fixed sequence do not vary from run to run; five standard errors leave room for
/// the luck of choosing the seed and still find an error of a percent.
constexpr double kStandardErrors = 5.0;

double mean_of(const std::vector<double>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

double variance_of(const std::vector<double>& values) {
  const double mean = mean_of(values);
  double sum = 0.0;
  for (const double value : values) sum += (value - mean) * (value - mean);
  return sum / static_cast<double>(values.size());
}

/// The largest distance between the empirical and the true distribution function, times sqrt(n).
template <typename Cdf>
double kolmogorov_statistic(std::vector<double> values, Cdf&& cdf) {
  std::sort(values.begin(), values.end());
  const double n = static_cast<double>(values.size());
  double distance = 0.0;
  for (std::size_t i = 0; i < values.size(); ++i) {
    const double expected = cdf(values[i]);
    distance = std::max({distance, std::abs(static_cast<double>(i) / n - expected),
                         std::abs(static_cast<double>(i + 1) / n - expected)});
  }
  return std::sqrt(n) * distance;
}

constexpr double kKolmogorovOneInAMillion = 2.7;  // P(K > 2.7) = 2 exp(-2 * 2.7^2) = 9e-7

// Random123, tests/kat_vectors, the three lines "philox4x32 10": counter, key, result.
TEST(Philox, GivesTheKnownAnswersOfRandom123) {
  EXPECT_THAT(philox4x32_10({0, 0, 0, 0}, {0, 0}),
              ElementsAre(0x6627e8d5, 0xe169c58d, 0xbc57ac4c, 0x9b00dbd8));
  EXPECT_THAT(
      philox4x32_10({0xffffffff, 0xffffffff, 0xffffffff, 0xffffffff}, {0xffffffff, 0xffffffff}),
      ElementsAre(0x408f276d, 0x41c83b0e, 0xa20bc7c6, 0x6d5451fd));
  EXPECT_THAT(
      philox4x32_10({0x243f6a88, 0x85a308d3, 0x13198a2e, 0x03707344}, {0xa4093822, 0x299f31d0}),
      ElementsAre(0xd16cfe09, 0x94fdcceb, 0x5001e420, 0x24126ea1));
}

TEST(Key, DependsOnSeedNameAndIndex) {
  const std::set<std::uint64_t> keys = {
      make_key(1, "camera.shot").value,    make_key(2, "camera.shot").value,
      make_key(1, "camera.read").value,    make_key(1, "camera.shot", 1).value,
      make_key(1, "camera.shot", 2).value, make_key(1, "").value,
  };
  EXPECT_EQ(keys.size(), 6U);
  EXPECT_EQ(make_key(1, "camera.shot", 1), make_key(1, "camera.shot", 1));
}

// Not published numbers but a promise: a seed gives the same session in the next release.
TEST(Distributions, KeepTheirNumbersFromReleaseToRelease) {
  const Key key = make_key(7, "golden");
  EXPECT_EQ(key.value, 0xBFA8DFFFE37F59B7U);
  EXPECT_EQ(uniform(key, 0), 0x1.aa9cc1e0caf4p-2);
  EXPECT_EQ(uniform(key, 1), 0x1.1cf4bbfecd052p-1);
  EXPECT_DOUBLE_EQ(normal(key, 0), 0.30042370263283286);
  EXPECT_EQ(poisson(key, 0, 3.0), 3);
  EXPECT_EQ(poisson(key, 0, 3e4), 30014);
  EXPECT_EQ(poisson(key, 0, 3e6), 3000122);
}

TEST(Uniform, IsSpreadEvenlyOverTheHalfOpenInterval) {
  std::vector<double> values(kDraws);
  fill_uniform(make_key(1, "uniform"), 0, values);
  EXPECT_GE(*std::min_element(values.begin(), values.end()), 0.0);
  EXPECT_LT(*std::max_element(values.begin(), values.end()), 1.0);
  EXPECT_LT(kolmogorov_statistic(values, [](double x) { return x; }), kKolmogorovOneInAMillion);
}

TEST(Uniform, HasNoCorrelationBetweenNeighbours) {
  std::vector<double> values(kDraws);
  fill_uniform(make_key(1, "neighbours"), 0, values);
  for (const std::size_t lag : {1U, 2U, 3U, 1000U}) {
    double sum = 0.0;
    for (std::size_t i = lag; i < values.size(); ++i) {
      sum += (values[i] - 0.5) * (values[i - lag] - 0.5) * 12.0;
    }
    const double n = static_cast<double>(values.size() - lag);
    EXPECT_NEAR(sum / n, 0.0, kStandardErrors / std::sqrt(n)) << "lag " << lag;
  }
}

TEST(Uniform, HasNoCorrelationBetweenStreams) {
  std::vector<double> a(kDraws);
  std::vector<double> b(kDraws);
  fill_uniform(make_key(1, "frames", 1), 0, a);
  fill_uniform(make_key(1, "frames", 2), 0, b);
  double sum = 0.0;
  for (std::size_t i = 0; i < kDraws; ++i) sum += (a[i] - 0.5) * (b[i] - 0.5) * 12.0;
  EXPECT_NEAR(sum / kDraws, 0.0, kStandardErrors / std::sqrt(static_cast<double>(kDraws)));
}

TEST(Normal, FollowsTheNormalDistribution) {
  std::vector<double> values(kDraws);
  fill_normal(make_key(1, "normal"), 0, values);
  const auto cdf = [](double x) { return 0.5 * std::erfc(-x / std::sqrt(2.0)); };
  EXPECT_LT(kolmogorov_statistic(values, cdf), kKolmogorovOneInAMillion);
  const double n = static_cast<double>(kDraws);
  EXPECT_NEAR(mean_of(values), 0.0, kStandardErrors / std::sqrt(n));
  EXPECT_NEAR(variance_of(values), 1.0, kStandardErrors * std::sqrt(2.0 / n));
}

TEST(Normal, HasTailsOfTheRightWeight) {
  std::vector<double> values(1'000'000);
  fill_normal(make_key(1, "tails"), 0, values);
  const auto beyond_three = static_cast<double>(
      std::count_if(values.begin(), values.end(), [](double x) { return std::abs(x) > 3.0; }));
  constexpr double kExpected = 2699.8;  // 1e6 * erfc(3 / sqrt(2))
  EXPECT_NEAR(beyond_three, kExpected, kStandardErrors * std::sqrt(kExpected));
}

// Wichura (1988) gives the first three as check values of PPND16.
TEST(NormalQuantile, GivesThePublishedPercentagePoints) {
  EXPECT_NEAR(normal_quantile(0.25), -0.6744897501960817, 1e-15);
  EXPECT_NEAR(normal_quantile(0.001), -3.090232306167814, 4e-15);
  EXPECT_NEAR(normal_quantile(1e-20), -9.262340089798408, 1e-14);
  EXPECT_NEAR(normal_quantile(0.975), 1.959963984540054, 2e-15);
  EXPECT_EQ(normal_quantile(0.5), 0.0);
}

TEST(NormalQuantile, InvertsTheDistributionFunction) {
  for (int i = 0; i < 1000; ++i) {
    const double p = (i + 0.5) / 1000.0;
    const double back = 0.5 * std::erfc(-normal_quantile(p) / std::sqrt(2.0));
    EXPECT_NEAR(back / p, 1.0, 1e-14) << p;
  }
}

TEST(NormalQuantile, RefusesWhatIsNoProbability) {
  for (const double p : {0.0, 1.0, -0.1, std::numeric_limits<double>::quiet_NaN()}) {
    EXPECT_THROW(normal_quantile(p), std::invalid_argument);
  }
}

class Poisson : public ::testing::TestWithParam<double> {};

TEST_P(Poisson, HasMeanVarianceAndSkewnessOfItsMean) {
  const double mean = GetParam();
  std::vector<double> counts(kDraws, mean);
  fill_poisson(make_key(1, "moments"), 0, counts, counts);
  const double n = static_cast<double>(kDraws);
  EXPECT_NEAR(mean_of(counts), mean, kStandardErrors * std::sqrt(mean / n));
  // The variance of the sample variance: (mu4 - sigma^4) / n with mu4 = mean + 3 mean^2.
  EXPECT_NEAR(variance_of(counts), mean,
              kStandardErrors * std::sqrt((mean + 2.0 * mean * mean) / n));
  if (mean > 1e6) return;  // a rounded normal number by then, without skewness
  double cubes = 0.0;
  for (const double count : counts) cubes += std::pow((count - mean) / std::sqrt(mean), 3.0);
  EXPECT_NEAR(cubes / n, 1.0 / std::sqrt(mean),
              kStandardErrors * std::sqrt(15.0 / n) * (1.0 + 5.0 / mean));
}

TEST_P(Poisson, CountsWholeNonNegativeNumbers) {
  std::vector<double> counts(10'000, GetParam());
  fill_poisson(make_key(1, "whole"), 0, counts, counts);
  for (const double count : counts) {
    ASSERT_GE(count, 0.0);
    ASSERT_EQ(count, std::floor(count));
  }
}

INSTANTIATE_TEST_SUITE_P(Means, Poisson,
                         ::testing::Values(0.01, 0.7, 5.0, 9.999, 10.0, 12.5, 100.0, 3e4, 1e6,
                                           3e6));

TEST(PoissonFrequencies, AreThoseOfTheDistribution) {
  // Both methods near where they meet; cells below 5 expected counts are left out.
  for (const double mean : {3.0, 9.5, 10.5, 40.0}) {
    std::vector<double> counts(kDraws, mean);
    fill_poisson(make_key(2, "frequencies"), 0, counts, counts);
    std::vector<double> seen(200, 0.0);
    for (const double count : counts) seen.at(static_cast<std::size_t>(count)) += 1.0;
    double chi_square = 0.0;
    int cells = 0;
    for (std::size_t k = 0; k < seen.size(); ++k) {
      const double x = static_cast<double>(k);
      const double expected = kDraws * std::exp(x * std::log(mean) - mean - std::lgamma(x + 1.0));
      if (expected < 5.0) continue;
      chi_square += (seen[k] - expected) * (seen[k] - expected) / expected;
      ++cells;
    }
    EXPECT_LT(chi_square, cells + kStandardErrors * std::sqrt(2.0 * cells)) << "mean " << mean;
  }
}

TEST(PoissonArguments, AllowZeroAndRefuseNonsense) {
  const Key key = make_key(1, "arguments");
  EXPECT_EQ(poisson(key, 0, 0.0), 0.0);
  EXPECT_THROW(poisson(key, 0, -1.0), std::invalid_argument);
  EXPECT_THROW(poisson(key, 0, std::numeric_limits<double>::quiet_NaN()), std::invalid_argument);
  EXPECT_THROW(poisson(key, 0, std::numeric_limits<double>::infinity()), std::invalid_argument);
  std::vector<double> out(2);
  EXPECT_THROW(fill_poisson(key, 0, std::vector<double>(3, 1.0), out), std::invalid_argument);
}

TEST(Fill, GivesTheNumbersOfTheValueFunctionsFromAnyStart) {
  const Key key = make_key(1, "fill");
  for (const std::uint64_t first : {std::uint64_t{0}, std::uint64_t{1}, std::uint64_t{1} << 40U}) {
    for (const std::size_t size : {0U, 1U, 2U, 511U, 512U, 1500U}) {
      std::vector<double> uniforms(size);
      std::vector<double> normals(size);
      std::vector<double> counts(size);
      fill_uniform(key, first, uniforms);
      fill_normal(key, first, normals);
      fill_poisson(key, first, std::vector<double>(size, 20.0), counts);
      for (std::size_t i = 0; i < size; ++i) {
        ASSERT_EQ(uniforms[i], uniform(key, first + i));
        ASSERT_EQ(normals[i], normal(key, first + i));
        ASSERT_EQ(counts[i], poisson(key, first + i, 20.0));
      }
    }
  }
}

TEST(Fill, GivesThePoissonNumbersOfDarkAndBrightPixelsSideBySide) {
  const Key key = make_key(2, "fill");
  std::vector<double> means;
  for (const double stretch : {0.0, 1e-17, 1e-3, 0.2, 3.0, 9.99, 10.0, 300.0, 1e5, 2e6}) {
    for (int i = 0; i < 600; ++i) means.push_back(stretch * (1.0 + 1e-4 * i));
  }
  // And all of them among each other.
  for (std::size_t i = 0; i < 3000; ++i) means.push_back(means[i * 2003 % 6000]);
  std::vector<double> counts(means.size());
  fill_poisson(key, 7, means, counts);
  for (std::size_t i = 0; i < means.size(); ++i) {
    ASSERT_EQ(counts[i], poisson(key, 7 + i, means[i])) << "mean " << means[i];
  }
}

TEST(Fill, GivesTheTailsOfTheNormalDistribution) {
  const Key key = make_key(3, "fill");
  std::vector<double> normals(2'000'000);
  fill_normal(key, 0, normals);
  // Beyond 5 sigma lie 5.7e-7 of them: seven in ten of such sets have one at least.
  std::size_t far = 0;
  for (std::size_t i = 0; i < normals.size(); ++i) {
    if (std::abs(normals[i]) < 4.0) continue;
    ++far;
    ASSERT_EQ(normals[i], normal(key, i));
  }
  EXPECT_NEAR(static_cast<double>(far), 126.7, 5.0 * std::sqrt(126.7));  // 2 Q(4) of 2e6
}

TEST(Stream, ReadsTheSequenceInOrder) {
  const Key key = make_key(1, "stream");
  Stream stream(key);
  EXPECT_EQ(stream.uniform(), uniform(key, 0));
  EXPECT_EQ(stream.normal(), normal(key, 1));
  EXPECT_EQ(stream.poisson(50.0), poisson(key, 2, 50.0));
  EXPECT_EQ(stream.uniform(), uniform(key, 3));
}

TEST(Stream, DrawsEveryNumberBelowABoundEquallyOften) {
  Stream stream(make_key(1, "below"));
  std::vector<double> seen(7, 0.0);
  for (std::size_t i = 0; i < kDraws; ++i) seen.at(stream.below(seen.size())) += 1.0;
  const double expected = static_cast<double>(kDraws) / 7.0;
  for (const double count : seen) {
    EXPECT_NEAR(count, expected, kStandardErrors * std::sqrt(expected));
  }
  EXPECT_EQ(stream.below(1), 0U);
  EXPECT_LT(stream.below((std::uint64_t{1} << 63U) + 1), (std::uint64_t{1} << 63U) + 1);
  EXPECT_THROW(stream.below(0), std::invalid_argument);
}

TEST(Stream, DrivesTheStandardLibrarysAlgorithms) {
  std::vector<int> items(50);
  std::iota(items.begin(), items.end(), 0);
  std::vector<int> shuffled = items;
  std::shuffle(shuffled.begin(), shuffled.end(), Stream(make_key(1, "shuffle")));
  EXPECT_NE(shuffled, items);
  EXPECT_THAT(shuffled, ::testing::UnorderedElementsAreArray(items));
}

}  // namespace
}  // namespace gonio::random
