#include "gonio/acquisition/trust_notes.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "temporary_folder.h"

namespace gonio::acquisition {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

TEST(SentinelNote, ReadsBackWhatWasWritten) {
  const SentinelReading written{{"G", {1234.5678901234567, 3e-4, milliseconds(20)}},
                                {"R", {0.125, 0.0, milliseconds(5)}}};
  const auto read = sentinel_from_text(sentinel_text(written));
  ASSERT_TRUE(read);
  ASSERT_EQ(read->size(), 2U);
  EXPECT_EQ(read->at("G").level_dn_per_s, 1234.5678901234567);
  EXPECT_EQ(read->at("G").relative_sigma, 3e-4);
  EXPECT_EQ(read->at("G").exposure, milliseconds(20));
  EXPECT_EQ(read->at("R").exposure, milliseconds(5));
}

TEST(SentinelNote, TakesNoTextThatIsNone) {
  for (const char* text :
       {"", ";", "R", "R 1 0.1", "R 1 0.1 5 6", "R nan 0.1 5", "R inf 0.1 5", "R -1 0.1 5",
        "R 0 0.1 5", "R 1 -0.1 5", "R 1 nan 5", "R 1 0.1 0", "R 1 0.1 -5", "R 1 0.1 5x",
        "R 1 0.1 99999999999999999999", "R 1 0.1 5;;", "R 1 0.1 5;G", "R  1 0.1 5"}) {
    EXPECT_FALSE(sentinel_from_text(text)) << '"' << text << '"';
  }
}

TEST(SentinelChange, IsAsUncertainAsBothReadings) {
  const SentinelLevel before{100.0, 0.003, milliseconds(20)};
  const SentinelLevel after{103.0, 0.004, milliseconds(20)};
  const SentinelChange noisy = sentinel_change(before, after, 0.0);
  EXPECT_NEAR(noisy.relative, 0.03, 1e-12);
  // 3-4-5, and twice the pose's 0.1 % as squares.
  EXPECT_NEAR(noisy.u * noisy.u, 25e-6 + 2e-6, 1e-12);
  EXPECT_GT(sentinel_change(before, after, 0.01).u, 0.014);
}

TEST(HomeDeltaNote, ChecksPointsOnlyWhereAllWasCompared) {
  EXPECT_TRUE(compares_all_axes(home_delta_text({"arm +0.0010 deg"}, false, true)));
  EXPECT_TRUE(
      compares_all_axes(home_delta_text({"arm +0.0010 deg", "tilt cannot tell"}, true, true)));
  EXPECT_FALSE(compares_all_axes(home_delta_text({"arm +0.0010 deg"}, false, false)));
  EXPECT_FALSE(compares_all_axes(home_delta_text({"tilt cannot tell"}, true, false)));
  const std::string whole = home_delta_text({"arm +0.0010 deg"}, true, true);
  for (std::size_t length = 0; length < whole.size(); ++length) {
    EXPECT_FALSE(compares_all_axes(std::string_view(whole).substr(0, length))) << length;
  }
}

class Suspects : public testing::Test {
 protected:
  void finish_point(int point, seconds at) {
    PointRecord record;
    record.point = point;
    record.outcome = PointOutcome::Measured;
    record.finished_at = at;
    archive_.append(record);
  }
  std::map<int, std::string> found() const { return suspect_points(SessionReader(folder_)); }

  TemporaryFolder temporary_;
  std::filesystem::path folder_ = temporary_.path() / "session";
  SessionWriter archive_{folder_, {}, {}};
};

TEST_F(Suspects, AreThoseNotMeasuredAgainSince) {
  finish_point(3, seconds(10));
  finish_point(4, seconds(20));
  archive_.note(seconds(30), kSuspectNote, suspect_text({3, 4}, "the lamp: stepped"));
  EXPECT_THAT(found(), testing::ElementsAre(testing::Pair(3, "the lamp: stepped"),
                                            testing::Pair(4, "the lamp: stepped")));
  finish_point(4, seconds(40));
  EXPECT_THAT(found(), testing::ElementsAre(testing::Pair(3, "the lamp: stepped")));
  archive_.note(seconds(50), kSuspectNote, suspect_text({4}, "again"));
  EXPECT_EQ(found().at(4), "again");
}

TEST_F(Suspects, AreNoneOfANoteThatNamesNoPoints) {
  finish_point(3, seconds(10));
  for (const char* text : {"", "points", "points : why", "3: why", "points 3x: why",
                           "points 7: why", "points -1 99999999999: why"}) {
    archive_.note(seconds(30), kSuspectNote, text);
  }
  archive_.note(seconds(30), "note", "points 3: somebody's words");
  EXPECT_THAT(found(), testing::IsEmpty());
}

}  // namespace
}  // namespace gonio::acquisition
