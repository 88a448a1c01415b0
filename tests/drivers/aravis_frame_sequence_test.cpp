#include <gtest/gtest.h>

#include <vector>

#include "frame_sequence.h"

namespace gonio::aravis_camera {
namespace {

using namespace std::chrono_literals;

FrameSequence::Verdict after(std::uint64_t first, std::uint64_t second) {
  FrameSequence sequence;
  sequence.next(first, 0, 0ns);
  return sequence.next(second, 0, 100ms);
}

TEST(FrameSequence, IdsThatCountByOneAreGood) {
  FrameSequence sequence;
  for (std::uint64_t id = 5; id < 10; ++id) {
    const auto verdict = sequence.next(id, id * 1'000'000, std::chrono::milliseconds(id));
    EXPECT_TRUE(verdict.problem.empty());
    EXPECT_EQ(verdict.missing, 0U);
    EXPECT_FALSE(verdict.jump);
  }
}

TEST(FrameSequence, SixteenBitIdsWrapWithoutZeroOrWithIt) {
  for (const std::uint64_t next : {1U, 0U}) {
    const auto verdict = after(65535, next);
    EXPECT_TRUE(verdict.problem.empty()) << next;
    EXPECT_EQ(verdict.missing, 0U) << next;
  }
  EXPECT_EQ(after(65534, 1).missing, 1U);
  EXPECT_EQ(after(65535, 3).missing, 2U);
}

TEST(FrameSequence, WideIdsGoOnPastSixteenBits) {
  EXPECT_EQ(after(65535, 65536).missing, 0U);
  EXPECT_TRUE(after(65535, 65536).problem.empty());
  EXPECT_EQ(after(1ULL << 40, (1ULL << 40) + 5).missing, 4U);
  EXPECT_FALSE(after(1ULL << 40, 1).problem.empty());
}

TEST(FrameSequence, RepeatedAndOlderIdsAreNoGoodFrames) {
  EXPECT_NE(after(7, 7).problem.find('7'), std::string::npos);
  EXPECT_FALSE(after(7, 6).problem.empty());
  EXPECT_FALSE(after(1, 65535).problem.empty());
  EXPECT_FALSE(after(2, 65530).problem.empty());
}

TEST(FrameSequence, GoesOnCountingFromTheNewestAfterAnOldFrame) {
  FrameSequence sequence;
  sequence.next(7, 0, 0ns);
  sequence.next(6, 0, 0ns);
  const auto verdict = sequence.next(8, 0, 0ns);
  EXPECT_TRUE(verdict.problem.empty());
  EXPECT_EQ(verdict.missing, 0U);
}

TEST(FrameSequence, CountsWhatIsMissing) { EXPECT_EQ(after(7, 11).missing, 3U); }

TEST(FrameSequence, TimeStampsMustGoOn) {
  FrameSequence sequence;
  sequence.next(1, 5'000'000'000, 1s);
  EXPECT_FALSE(sequence.next(2, 5'000'000'000, 2s).problem.empty());
  EXPECT_FALSE(sequence.next(3, 4'000'000'000, 3s).problem.empty());
  EXPECT_TRUE(sequence.next(4, 5'000'000'000, 4s).problem.empty());
}

TEST(FrameSequence, NoticesAClockThatLeapsAgainstTheHosts) {
  FrameSequence sequence;
  sequence.next(1, 1'000'000'000, 10s);
  EXPECT_FALSE(sequence.next(2, 2'100'000'000, 11s).jump);  // 0.1 s on the way
  EXPECT_TRUE(sequence.next(3, 9'000'000'000, 12s).jump);
  EXPECT_TRUE(sequence.next(4, 9'100'000'000, 13s).jump);
  EXPECT_FALSE(sequence.next(5, 10'100'000'000, 14s).jump);
}

TEST(FrameSequence, LeavesOutTimeStampsOfACameraWithoutAClock) {
  FrameSequence sequence;
  sequence.next(1, 0, 0s);
  const auto verdict = sequence.next(2, 0, 60s);
  EXPECT_TRUE(verdict.problem.empty());
  EXPECT_FALSE(verdict.jump);
}

TEST(FrameSequence, NewAcquisitionCountsAnew) {
  FrameSequence sequence;
  sequence.next(100, 5'000'000'000, 1s);
  sequence.restart();
  EXPECT_TRUE(sequence.next(1, 1'000'000'000, 2s).problem.empty());
}

}  // namespace
}  // namespace gonio::aravis_camera
