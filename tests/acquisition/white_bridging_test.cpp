#include "white_bridging.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

namespace gonio::acquisition {
namespace {

constexpr double kMinute = 60.0;
constexpr double kWhiteU = 0.001;

/// Levels of whites and sentinels that were not measured but said.
class WhiteBridging : public testing::Test {
 protected:
  void white(std::size_t part, double time_s, double level, double u = kWhiteU) {
    level_.visits.push_back({part, time_s, brdf::Rgb::Constant(level), brdf::Rgb::Constant(u)});
  }
  void sentinel(std::size_t part, double time_s, double level, double u = kWhiteU) {
    sentinels_.push_back({part, {time_s, brdf::Rgb::Constant(level), brdf::Rgb::Constant(u * u)}});
  }
  void bridge(std::size_t parts) { bridge_whites(sentinels_, parts, 0.0, level_); }

  double at(double time_s, std::size_t part) const { return level_.at(time_s, part)[1]; }
  double constant(std::size_t visit) const { return level_.visits.at(visit).constant[1]; }

  /// Part 0 with its white and sentinel, and part 2; nothing but a bridge between.
  void two_ends(double white_factor, double sentinel_factor) {
    white(0, 0.0, 1.0);
    sentinel(0, 10.0, 1.0);
    white(2, 100 * kMinute, white_factor);
    sentinel(2, 100 * kMinute + 10.0, sentinel_factor);
  }

  WhiteLevel level_;
  std::vector<PartSentinel> sentinels_;
};

TEST_F(WhiteBridging, ThePartInTheMiddleKeepsBothFactors) {
  // The light 4 % up each time; the one white of the middle part 2 % off, by a noise that allows
  // it.
  const double light[] = {1.0, 1.04, 1.04 * 1.04};
  constexpr double kNoisy = 0.01;
  for (std::size_t part = 0; part < 3; ++part) {
    const double time_s = 60 * kMinute * static_cast<double>(part);
    white(part, time_s, light[part] * (part == 1 ? 1.02 : 1.0), part == 1 ? kNoisy : kWhiteU);
    sentinel(part, time_s + 10.0, 7.0 * light[part]);
  }
  bridge(3);
  ASSERT_EQ(level_.bridges.size(), 2U);
  // Each as the whites were measured: by the sentinels nearly, and as far from 4 % one way as the
  // other.
  for (const PartBridge& each : level_.bridges) {
    ASSERT_TRUE(each.is_applied());
    EXPECT_NEAR(each.change_relative, 0.04, 0.001);
  }
  EXPECT_NEAR((1.0 + level_.bridges[0].change_relative) * (1.0 + level_.bridges[1].change_relative),
              1.04 * 1.04, 1e-5);
  // What is left of the 2 %: the noise of sentinels over that of the white, squared.
  EXPECT_NEAR(constant(1) / constant(0), 1.04, 0.0005);
  EXPECT_NEAR(constant(2) / constant(1), 1.04, 0.0005);
  EXPECT_NEAR(constant(2) / constant(0), 1.04 * 1.04, 0.0002);
}

TEST_F(WhiteBridging, APartThatEndsWithAnotherWhiteIsBridgedFromThere) {
  const double light[] = {1.0, 1.04, 1.04 * 1.04};
  for (std::size_t part = 0; part < 3; ++part) {
    const double time_s = 60 * kMinute * static_cast<double>(part);
    white(part, time_s, light[part]);
    sentinel(part, time_s + 10.0, light[part]);
    white(part, time_s + 20 * kMinute, light[part]);
    sentinel(part, time_s + 20 * kMinute + 10.0, light[part]);
  }
  bridge(3);
  ASSERT_EQ(level_.bridges.size(), 2U);
  for (std::size_t i = 0; i < 6; ++i) EXPECT_NEAR(constant(i), light[i / 2], 1e-9);
  EXPECT_NEAR(at(70 * kMinute, 1), 1.04, 1e-9);
  EXPECT_NEAR(at(100 * kMinute, 1), 1.04, 1e-9) << "behind its last white";
  EXPECT_NEAR(at(110 * kMinute, 2), 1.04 * 1.04, 1e-9) << "before its first";
}

TEST_F(WhiteBridging, SentinelsAreFollowedBehindTheLastWhiteThoughNothingIsBridged) {
  constexpr double kNoise = 0.001;  // of a white
  // The lamp goes up by 4 % in the first part and has come back when the second begins.
  white(0, 0.0, 1.0);
  for (const double minutes : {0.0, 10.0, 20.0, 30.0, 40.0}) {
    sentinel(0, minutes * kMinute, 5.0 * (1.0 + 0.001 * minutes));
  }
  white(1, 60 * kMinute, 1.0 + kNoise);
  sentinel(1, 60 * kMinute, 5.0);
  sentinel(1, 90 * kMinute, 5.0);
  bridge(2);
  ASSERT_EQ(level_.bridges.size(), 1U);
  ASSERT_FALSE(level_.bridges[0].is_applied());
  ASSERT_FALSE(level_.bridges[0].is_refused());
  for (const double minutes : {0.0, 15.0, 40.0, 50.0}) {  // the last behind all its sentinels
    const double joined = 1.0 + kNoise * minutes / 60.0;
    EXPECT_NEAR(at(minutes * kMinute, 0), joined * (1.0 + 0.001 * minutes), 1e-9)
        << minutes << " min";
  }
  EXPECT_NEAR(at(75 * kMinute, 1), 1.0 + kNoise, 1e-9);
}

TEST_F(WhiteBridging, SentinelsAreFollowedBeforeTheFirstWhiteOfAPart) {
  white(0, 0.0, 1.0);
  sentinel(0, 0.0, 5.0);
  sentinel(0, 30 * kMinute, 5.0);
  sentinel(1, 60 * kMinute, 5.0 * 1.03);
  sentinel(1, 70 * kMinute, 5.0 * 1.015);
  white(1, 80 * kMinute, 1.0);
  sentinel(1, 80 * kMinute, 5.0);
  bridge(2);
  ASSERT_FALSE(level_.bridges.at(0).is_applied());
  ASSERT_FALSE(level_.bridges.at(0).is_refused());
  EXPECT_NEAR(at(20 * kMinute, 0), 1.0, 1e-9);
  EXPECT_NEAR(at(65 * kMinute, 1), 1.0225, 1e-9);
}

TEST_F(WhiteBridging, SentinelsOfOnePartAloneAreFollowedThere) {
  white(0, 0.0, 1.0);
  sentinel(0, 0.0, 5.0);
  sentinel(0, 20 * kMinute, 5.1);
  sentinel(0, 40 * kMinute, 5.2);
  white(1, 600 * kMinute, 1.0);
  bridge(2);
  ASSERT_FALSE(level_.bridges.at(0).is_applied());
  EXPECT_NEAR(at(40 * kMinute, 0), 1.04, 1e-9);
  EXPECT_NEAR(at(600 * kMinute, 1), 1.0, 1e-9);
}

TEST_F(WhiteBridging, LevelsThatAgreeAreInterpolatedAcross) {
  white(0, 0.0, 1.0);
  sentinel(0, 0.0, 5.0);
  white(1, 100.0, 1.001);
  sentinel(1, 100.0, 5.002);
  bridge(2);
  EXPECT_NEAR(at(25.0, 0), 1.00025, 1e-12);
  EXPECT_NEAR(at(75.0, 1), 1.00075, 1e-12);
}

/// The light goes up by 2 % in 30 minutes and so through the interruption; sentinels in one part
/// lie 25 minutes from its white.
class HonestDrift : public WhiteBridging {
 protected:
  static double light(double minutes) { return 1.0 + 0.02 * minutes / 30.0; }
  void white_in(std::size_t part, double minutes, double factor = 1.0) {
    white(part, minutes * kMinute, factor * light(minutes));
  }
  void sentinel_in(std::size_t part, double minutes) {
    sentinel(part, minutes * kMinute, 5.0 * light(minutes));
  }
};

TEST_F(HonestDrift, SeenBySentinelsIsNoContradiction) {
  for (const double minutes : {0.0, 30.0, 60.0, 90.0}) sentinel_in(0, minutes);
  white_in(0, 0.0);
  white_in(0, 115.0);
  white_in(1, 120.0);
  sentinel_in(1, 121.0);
  bridge(2);
  EXPECT_FALSE(level_.bridges.at(0).is_refused()) << to_text(level_.bridges[0]);
  EXPECT_LT(std::abs(level_.bridges[0].disagreement_relative), 0.002);
}

TEST_F(HonestDrift, SeenByWhitesIsNoContradiction) {
  white_in(0, 0.0);
  sentinel_in(0, 0.5);
  white_in(0, 25.5);
  white_in(1, 28.0);
  sentinel_in(1, 28.5);
  bridge(2);
  EXPECT_FALSE(level_.bridges.at(0).is_refused()) << to_text(level_.bridges[0]);
  EXPECT_LT(std::abs(level_.bridges[0].disagreement_relative), 0.002);
  EXPECT_LT(level_.bridges[0].u_disagreement_relative, 0.005);
}

TEST_F(HonestDrift, SeenByNobodyIsNoContradiction) {
  white_in(0, 0.0);
  sentinel_in(0, 25.0);
  white_in(1, 28.0);
  sentinel_in(1, 28.5);
  bridge(2);
  EXPECT_FALSE(level_.bridges.at(0).is_refused()) << to_text(level_.bridges[0]);
}

TEST_F(HonestDrift, HidesNoWhiteThatBecameDirty) {
  for (const double minutes : {0.0, 30.0, 60.0, 90.0, 120.0}) sentinel_in(0, minutes);
  white_in(0, 0.0);
  white_in(0, 95.0);
  white_in(1, 125.0, 0.99);
  sentinel_in(1, 126.0);
  bridge(2);
  EXPECT_TRUE(level_.bridges.at(0).is_refused()) << to_text(level_.bridges[0]);
  EXPECT_NEAR(level_.bridges[0].disagreement_relative, -0.01, 0.002);
}

TEST_F(WhiteBridging, APartWithoutAWhiteBelongsToNeitherEndOfABridgeThatIsRefused) {
  two_ends(0.97, 1.0);
  bridge(4);
  ASSERT_TRUE(level_.bridges.at(0).is_refused());
  EXPECT_EQ(level_.bridges[0].from, 0U);
  EXPECT_FALSE(level_.is_unbridged(0));
  EXPECT_TRUE(level_.is_unbridged(1));
  EXPECT_TRUE(level_.is_unbridged(2));
  EXPECT_TRUE(level_.is_unbridged(3)) << "behind all of them";
  EXPECT_NEAR(at(50 * kMinute, 1), 1.0, 1e-9);
}

TEST_F(WhiteBridging, ASentinelThatReadsAsBeforeAttachesAPartWithoutAWhite) {
  two_ends(0.97, 1.0);
  sentinel(1, 50 * kMinute, 1.0);
  bridge(3);
  ASSERT_TRUE(level_.bridges.at(0).is_refused());
  EXPECT_FALSE(level_.is_unbridged(1));
  EXPECT_TRUE(level_.is_unbridged(2));
}

TEST_F(WhiteBridging, OneThatReadsAnotherDoesNotWhereWhitesContradictIt) {
  two_ends(1.0, 0.97);
  sentinel(1, 50 * kMinute, 0.97);
  bridge(3);
  ASSERT_TRUE(level_.bridges.at(0).is_refused());
  EXPECT_TRUE(level_.is_unbridged(1)) << "it may be the sample that changed";
}

TEST_F(WhiteBridging, SentinelsTellTheLightOfAPartWithoutAWhite) {
  two_ends(1.03, 1.03);
  sentinel(1, 50 * kMinute, 1.02);
  bridge(3);
  ASSERT_TRUE(level_.bridges.at(0).is_applied());
  EXPECT_FALSE(level_.is_unbridged(1));
  EXPECT_NEAR(at(50 * kMinute, 1), 1.02, 1e-4);
  EXPECT_NEAR(at(5.0, 0), 1.0, 1e-4);
  EXPECT_NEAR(at(101 * kMinute, 2), 1.03, 1e-9);
}

TEST_F(WhiteBridging, WithoutSentinelsItIsKnownOnlyAmidOneLight) {
  two_ends(1.03, 1.03);
  bridge(4);
  ASSERT_TRUE(level_.bridges.at(0).is_applied());
  EXPECT_TRUE(level_.is_unbridged(1));
  EXPECT_FALSE(level_.is_unbridged(2));
  EXPECT_TRUE(level_.is_unbridged(3)) << "nothing behind it";

  level_ = {};
  sentinels_.clear();
  two_ends(1.001, 1.001);
  bridge(3);
  EXPECT_FALSE(level_.is_unbridged(1));

  level_ = {};
  sentinels_.clear();
  white(0, 0.0, 1.0);
  white(2, 100 * kMinute, 1.001);
  bridge(3);
  EXPECT_FALSE(level_.is_unbridged(1)) << "by whites alone";
}

}  // namespace
}  // namespace gonio::acquisition
