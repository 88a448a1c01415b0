// Sweep A: with drift and homing scatter off, a session that was killed at any write, sync or
// rename, cut off by a power failure there, or failed there on a full or broken disk, and then
// resumed, gives the samples of the uninterrupted one to the byte. GONIO_KILL_SWEEP=all takes every
// moment instead of a sample of them.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cerrno>
#include <cstdlib>
#include <optional>
#include <set>

#include "gonio/errors/errors.h"
#include "recorded_disk.h"
#include "steady_session.h"

namespace gonio {
namespace {

using acquisition::ResumeState;
using acquisition::SessionReader;

using Loss = RecordedDisk::Loss;
constexpr std::array<Loss, 4> kLosses{Loss::nothing, Loss::unsynced, Loss::at_random,
                                      Loss::half_write};

class KillSweep : public SteadySession {
 protected:
  KillSweep() { options_.sentinel_every = 5; }

  /// Whether a session had begun at all: what it is to do stands in the archive.
  static bool begun(const std::filesystem::path& folder) {
    try {
      return !SessionReader(folder).metadata().empty();
    } catch (const std::exception&) {
      return false;
    }
  }

  /// The whole promise, for an archive whose writer died after `acknowledged` points; -1: before it
  /// was there.
  void expect_resumes(const std::filesystem::path& folder, int acknowledged) {
    if (!begun(folder)) {
      EXPECT_LT(acknowledged, 0);
      ++never_begun_;
      return;
    }
    const ResumeState before = acquisition::resume_state(SessionReader(folder));
    EXPECT_GE(static_cast<int>(before.done.size()), acknowledged);
    EXPECT_THAT(before.again, testing::IsEmpty());
    EXPECT_TRUE(before.finished || resume(folder).complete);
    const SessionReader after(folder);
    EXPECT_TRUE(after.finished());
    EXPECT_THAT(after.damage(), testing::IsEmpty());
    EXPECT_EQ(after.points().size(), plan_.points.size()) << "none was acknowledged twice";
    EXPECT_LE(begun_twice(after), 1);
    EXPECT_EQ(samples_of(folder), wanted_);
    ++resumed_;
  }

  /// Points with frames of both parts.
  static int begun_twice(const SessionReader& archive) {
    std::chrono::nanoseconds resumed = std::chrono::nanoseconds::max();
    for (const auto& note : archive.notes()) {
      if (note.kind == "resumed") resumed = note.at;
    }
    std::set<int> before;
    std::set<int> both;
    for (const auto& frame : archive.frames()) {
      if (frame.point < 0) continue;
      if (frame.exposure_start < resumed) {
        before.insert(frame.point);
      } else if (before.contains(frame.point)) {
        both.insert(frame.point);
      }
    }
    return static_cast<int>(both.size());
  }

  /// Every so many of them, or all.
  static std::size_t stride(std::size_t count, std::size_t wanted) {
    const char* all = std::getenv("GONIO_KILL_SWEEP");
    if (all != nullptr && std::string(all) == "all") return 1;
    // Odd, so that all kinds of operations have their turn.
    return std::max<std::size_t>(1, count / wanted) | 1U;
  }

  std::string wanted_;  ///< samples of the uninterrupted session
  int never_begun_ = 0;
  int resumed_ = 0;
};

TEST_F(KillSweep, LosesNothingWhereverTheProcessOrThePowerEnds) {
  ASSERT_EQ(plan_.points.size(), 12U);
  const TemporaryFolder folder;
  const std::filesystem::path whole = folder.path() / "whole";
  RecordedDisk disk(whole);
  std::vector<std::size_t> acknowledged_at;  // number of operations, per number of points
  begin(whole, [&](const acquisition::SessionProgress& now) {
    while (acknowledged_at.size() <= static_cast<std::size_t>(now.done)) {
      acknowledged_at.push_back(disk.count());
    }
  });
  const std::size_t count = disk.count();
  ASSERT_EQ(acknowledged_at.size(), 13U);
  wanted_ = samples_of(whole);
  const std::size_t step = stride(count, 50);
  std::size_t turn = 0;
  for (std::size_t k = 0; k <= count; k += step) {
    for (std::size_t l = 0; l < kLosses.size(); ++l) {
      if (step > 1 && l != turn % kLosses.size()) continue;
      SCOPED_TRACE(testing::Message() << "operation " << k << " of " << count << ", loss " << l);
      const TemporaryFolder disk_after;
      const std::filesystem::path cut = disk_after.path() / "session";
      disk.restore(k, kLosses[l], k, cut);
      const auto acknowledged =
          std::upper_bound(acknowledged_at.begin(), acknowledged_at.end(), k) -
          acknowledged_at.begin() - 1;
      expect_resumes(cut, static_cast<int>(acknowledged));
      if (HasFailure()) return;
    }
    ++turn;
  }
  EXPECT_GT(resumed_, never_begun_);
  std::printf("%zu operations, every %zu: %d resumed, %d never begun\n", count, step, resumed_,
              never_begun_);
}

TEST_F(KillSweep, LosesNothingWhereverTheDiskFillsUpOrFails) {
  const TemporaryFolder folder;
  std::size_t count = 0;
  {
    RecordedDisk disk(folder.path() / "whole");
    begin(folder.path() / "whole");
    count = disk.count();
  }
  wanted_ = samples_of(folder.path() / "whole");
  const std::size_t step = stride(count, 20);
  for (std::size_t k = 1; k < count; k += step) {
    SCOPED_TRACE(testing::Message() << "operation " << k << " of " << count);
    const TemporaryFolder disk_after;
    const std::filesystem::path cut = disk_after.path() / "session";
    int acknowledged = -1;
    {
      RecordedDisk disk(cut);
      disk.fail_from(k, k % 2 == 0 ? ENOSPC : EIO);
      bool failed = false;
      try {
        begin(cut, [&](const acquisition::SessionProgress& now) { acknowledged = now.done; });
      } catch (const FileError&) {
        failed = true;
      }
      // Only the log of a finished session may be left as it is without a word.
      EXPECT_TRUE(failed || SessionReader(cut).finished());
    }
    // Where the disk works again: who reads what a failure left has to write (SQLite's log).
    EXPECT_EQ(std::filesystem::exists(cut), begun(cut)) << "a session that could not begin";
    expect_resumes(cut, acknowledged);
    if (HasFailure()) return;
  }
  std::printf("%zu operations, every %zu: %d resumed, %d never begun\n", count, step, resumed_,
              never_begun_);
}

TEST_F(KillSweep, LosesNothingWhereverAResumedSessionEndsAgain) {
  const TemporaryFolder folder;
  const std::filesystem::path whole = folder.path() / "whole";
  const std::filesystem::path cut = folder.path() / "cut";
  {
    RecordedDisk disk(whole);
    std::size_t within_the_fifth = 0;
    begin(whole, [&](const acquisition::SessionProgress& now) {
      constexpr std::size_t kSomeOfItsFrames = 25;
      if (now.done == 4) within_the_fifth = disk.count() + kSomeOfItsFrames;
    });
    disk.restore(within_the_fifth, RecordedDisk::Loss::half_write, 0, cut);
  }
  wanted_ = samples_of(whole);
  const TemporaryFolder again;
  std::filesystem::copy(cut, again.path() / "session", std::filesystem::copy_options::recursive);
  RecordedDisk disk(again.path() / "session");
  std::vector<std::size_t> acknowledged_at(5, 0);
  EXPECT_TRUE(resume(again.path() / "session", [&](const acquisition::SessionProgress& now) {
                while (acknowledged_at.size() <= static_cast<std::size_t>(now.done)) {
                  acknowledged_at.push_back(disk.count());
                }
              }).complete);
  const std::size_t count = disk.count();
  ASSERT_EQ(acknowledged_at.size(), 13U);
  const std::size_t step = stride(count, 25);
  std::size_t turn = 0;
  for (std::size_t k = 0; k <= count; k += step, ++turn) {
    for (std::size_t l = 0; l < kLosses.size(); ++l) {
      if (step > 1 && l != turn % kLosses.size()) continue;
      SCOPED_TRACE(testing::Message() << "operation " << k << " of " << count << ", loss " << l);
      const TemporaryFolder disk_after;
      const std::filesystem::path twice = disk_after.path() / "session";
      disk.restore(k, kLosses[l], k, twice);
      const auto acknowledged =
          std::upper_bound(acknowledged_at.begin(), acknowledged_at.end(), k) -
          acknowledged_at.begin() - 1;
      expect_resumes(twice, static_cast<int>(acknowledged));
      if (HasFailure()) return;
    }
  }
  EXPECT_EQ(never_begun_, 0);
  std::printf("%zu operations, every %zu: %d resumed twice\n", count, step, resumed_);
}

TEST_F(KillSweep, LosesNothingWhereTheClosingWhiteEndsTwice) {
  // No frame of the sample lies between the opening white of the second part and its closing one.
  options_.sentinel_every = 0;
  options_.first_exposure = std::chrono::microseconds(200);  // two frames of each channel
  const auto begins_at = [](const RecordedDisk& disk, std::size_t& count) {
    return [&](const acquisition::SessionProgress& now) {
      if (now.phase == "closing white") count = disk.count();
    };
  };
  const TemporaryFolder folder;
  const std::filesystem::path whole = folder.path() / "whole";
  const std::filesystem::path cut = folder.path() / "cut";
  {
    RecordedDisk disk(whole);
    std::size_t closing = 0;
    begin(whole, begins_at(disk, closing));
    disk.restore(closing, Loss::nothing, 0, cut);
  }
  wanted_ = samples_of(whole);
  const TemporaryFolder again;
  const std::filesystem::path second = again.path() / "session";
  std::filesystem::copy(cut, second, std::filesystem::copy_options::recursive);
  RecordedDisk disk(second);
  std::size_t closing = 0;
  EXPECT_TRUE(resume(second, begins_at(disk, closing)).complete);
  ASSERT_GT(closing, 0U);
  constexpr std::size_t kStep = 5;
  for (std::size_t k = closing; k < disk.count(); k += kStep) {
    SCOPED_TRACE(testing::Message() << "operation " << k << " of " << disk.count());
    const TemporaryFolder disk_after;
    const std::filesystem::path twice = disk_after.path() / "session";
    disk.restore(k, Loss::nothing, k, twice);
    expect_resumes(twice, 12);
    if (HasFailure()) return;
  }
  EXPECT_GT(resumed_, 5);
}

TEST_F(KillSweep, DoesNothingWithAFinishedSession) {
  const TemporaryFolder folder;
  const std::filesystem::path whole = folder.path() / "whole";
  EXPECT_TRUE(begin(whole).complete);
  EXPECT_TRUE(acquisition::resume_state(SessionReader(whole)).finished);
  EXPECT_THROW(resume(whole), std::logic_error);
}

TEST_F(KillSweep, GoesOnAtTheVeryMomentThatItEnded) {
  const TemporaryFolder folder;
  const std::filesystem::path whole = folder.path() / "whole";
  const std::filesystem::path cut = folder.path() / "cut";
  {
    RecordedDisk disk(whole);
    std::size_t after_five = 0;
    begin(whole, [&](const acquisition::SessionProgress& now) {
      if (now.done == 5 && after_five == 0) after_five = disk.count();
    });
    disk.restore(after_five, Loss::nothing, 0, cut);
  }
  wanted_ = samples_of(whole);
  outage_ = std::chrono::seconds(0);
  expect_resumes(cut, 5);
}

TEST_F(KillSweep, MeasuresAPointAgainWhoseFrameWasSpoilt) {
  const TemporaryFolder folder;
  const std::filesystem::path whole = folder.path() / "whole";
  RecordedDisk disk(whole);
  std::size_t after_five = 0;
  begin(whole, [&](const acquisition::SessionProgress& now) {
    if (now.done == 5 && after_five == 0) after_five = disk.count();
  });
  wanted_ = samples_of(whole);
  const std::filesystem::path cut = folder.path() / "cut";
  disk.restore(after_five, RecordedDisk::Loss::nothing, 0, cut);
  std::string spoilt;
  const SessionReader archive(cut);
  for (const auto& frame : archive.frames()) {
    if (frame.point == 3) spoilt = frame.file;
  }
  std::filesystem::resize_file(cut / spoilt, 100);
  const ResumeState state = acquisition::resume_state(SessionReader(cut));
  EXPECT_THAT(state.again, testing::ElementsAre(testing::HasSubstr("point 3")));
  EXPECT_EQ(state.done.size(), 4U);
  EXPECT_TRUE(resume(cut).complete);
  EXPECT_EQ(samples_of(cut), wanted_);
}

}  // namespace
}  // namespace gonio
