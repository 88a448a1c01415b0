// A lamp's monitor that reads low now and then: flicker, no lamp that is off.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <memory>

#include "gonio/acquisition/archive_observer.h"
#include "gonio/acquisition/trust_notes.h"
#include "steady_session.h"

namespace gonio {
namespace {

using acquisition::SessionProgress;
using acquisition::SessionReader;
using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;
using testing::StartsWith;

/// Reads next to nothing when it is told to.
class DippingMonitor final : public devices::LampMonitor {
 public:
  explicit DippingMonitor(devices::LampMonitor& inner) : inner_(inner) {}
  std::function<bool()> dips = [] { return false; };

  const std::string& name() const override { return inner_.name(); }
  double read() override {
    constexpr double kAlmostNothing = 1e-3;
    return inner_.read() * (dips() ? kAlmostNothing : 1.0);
  }

 private:
  devices::LampMonitor& inner_;
};

/// Twelve points with a sentinel every four.
class LampWatch : public SteadySession {
 protected:
  LampWatch() { options_.sentinel_every = 4; }

  acquisition::DeviceSet devices(sim::SimGoniometer& world) const override {
    acquisition::DeviceSet set = SteadySession::devices(world);
    monitor_ = std::make_unique<DippingMonitor>(*set.monitor);
    set.monitor = monitor_.get();
    return set;
  }

  /// In the first `phase` with `done` points: the readings with these numbers from 0 are low.
  acquisition::SessionResult begin_dipping(const std::string& phase, int done,
                                           const std::function<bool(int)>& is_low) {
    sim::SimGoniometer world(world_);
    acquisition::SessionWriter archive(session_, {{"sample_id", "plate"}}, {});
    bool begun = false;
    return run(world, archive, [&](const SessionProgress& now) {
      const bool mine = !begun && now.phase == phase && now.done == done;
      begun = begun || mine;
      monitor_->dips = [mine, is_low, reading = 0]() mutable { return mine && is_low(reading++); };
    });
  }

  std::vector<std::string> notes(const std::string& kind) const { return notes_of(session_, kind); }

  mutable std::unique_ptr<DippingMonitor> monitor_;
  TemporaryFolder folder_;
  std::filesystem::path session_ = folder_.path() / "session";
};

TEST_F(LampWatch, OneLowReadingAtAPointMakesItSuspectAndEndsNothing) {
  EXPECT_TRUE(begin_dipping("point", 5, [](int reading) { return reading == 4; }).complete);
  EXPECT_THAT(notes(acquisition::kSuspectNote),
              ElementsAre(AllOf(StartsWith("points 5: "), HasSubstr("lamp monitor read"))));
  EXPECT_THAT(SessionReader(session_).points(), SizeIs(13));
  EXPECT_THAT(acquisition::suspect_points(SessionReader(session_)), IsEmpty());
}

TEST_F(LampWatch, ASentinelReadInFlickeringLightIsReadAgain) {
  EXPECT_TRUE(begin_dipping("check", 4, [](int reading) { return reading == 4; }).complete);
  EXPECT_THAT(notes(acquisition::kSentinelAgainNote), ElementsAre(HasSubstr("lamp monitor read")));
  EXPECT_THAT(notes(acquisition::kSentinelNote), SizeIs(4));
  EXPECT_THAT(notes(acquisition::kSuspectNote), IsEmpty());
  EXPECT_THAT(SessionReader(session_).points(), SizeIs(12));
}

TEST_F(LampWatch, WhatASentinelInFlickeringLightDidNotCheckTheNextOneChecks) {
  const std::filesystem::path whole = folder_.path() / "whole";
  begin(whole);
  const SessionReader untroubled(whole);
  world_.lamp.events = {
      {untroubled.points().at(1).finished_at + std::chrono::milliseconds(1), {}, 1.03, false}};
  EXPECT_TRUE(begin_dipping("check", 4, [](int reading) { return reading % 3 == 0; }).complete);
  EXPECT_THAT(
      notes(acquisition::kNoSentinelNote),
      testing::Contains(AllOf(HasSubstr("no sentinel this time"), HasSubstr("lamp monitor read"))));
  EXPECT_THAT(notes(acquisition::kSentinelAgainNote),
              SizeIs(static_cast<std::size_t>(options_.retries)));
  EXPECT_THAT(notes(acquisition::kSuspectNote),
              ElementsAre(AllOf(StartsWith("points 0 1 2 3 4 5 6 7: "),
                                HasSubstr("sentinel changed by +"))));
}

TEST_F(LampWatch, PointsThatNoSentinelComesBehindAreMeasuredAgain) {
  EXPECT_TRUE(begin_dipping("check", 12, [](int reading) { return reading % 3 == 0; }).complete);
  EXPECT_THAT(
      notes(acquisition::kSuspectNote),
      ElementsAre(AllOf(StartsWith("points 8 9 10 11: "), HasSubstr("last sentinel could not"))));
  EXPECT_THAT(SessionReader(session_).points(), SizeIs(16));
  EXPECT_THAT(acquisition::suspect_points(SessionReader(session_)), IsEmpty());
}

/// Whether the session has been at its sentinel.
class SentinelSeen final : public acquisition::ArchiveObserver {
 public:
  bool seen = false;
  void on_frame(const acquisition::FrameRecord& record, const devices::Frame&) noexcept override {
    seen = seen || record.kind == acquisition::FrameKind::sentinel;
  }
  void on_point(const acquisition::PointRecord&) noexcept override {}
  void on_note(const acquisition::SessionNote&) noexcept override {}
};

TEST_F(LampWatch, ASessionThatCannotReadItsFirstSentinelEnds) {
  sim::SimGoniometer world(world_);
  acquisition::SessionWriter archive(session_, {{"sample_id", "plate"}}, {});
  SentinelSeen sentinel;
  archive.observe(&sentinel);
  int reading = 0;
  try {
    run(world, archive, [&](const SessionProgress&) {
      monitor_->dips = [&] { return sentinel.seen && reading++ % 3 == 0; };
    });
    FAIL() << "went on without a sentinel";
  } catch (const devices::DeviceError& error) {
    EXPECT_THAT(error.what(), HasSubstr("no steady light at the sentinel"));
  }
  EXPECT_THAT(notes(acquisition::kSentinelAgainNote),
              SizeIs(static_cast<std::size_t>(options_.retries)));
  EXPECT_THAT(SessionReader(session_).points(), IsEmpty());
}

TEST_F(LampWatch, ALampThatIsOffAtTheSentinelEndsTheSession) {
  try {
    begin_dipping("check", 4, [](int) { return true; });
    FAIL() << "went on in the dark";
  } catch (const devices::DeviceError& error) {
    EXPECT_THAT(error.what(), HasSubstr("is the lamp on?"));
  }
}

}  // namespace
}  // namespace gonio
