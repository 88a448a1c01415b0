// What a homing has found, though its answer is lost, another axis fails or it cannot tell: no slip
// may be hidden by the homing that comes after.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <memory>

#include "gonio/acquisition/trust_notes.h"
#include "gonio/devices/homing_report.h"
#include "gonio/sim/joint.h"
#include "steady_session.h"

namespace gonio {
namespace {

using acquisition::SessionReader;
using devices::DeviceErrc;
using devices::DeviceError;
using testing::AllOf;
using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;
using testing::SizeIs;
using testing::StartsWith;
using namespace gonio::literals;

constexpr Angle kSlip = 0.05_deg;

/// What goes wrong at a homing, by its number from 1.
enum class Homing {
  as_it_should,
  answer_lost,        ///< when the mark is found and its place known
  answer_lost_early,  ///< when the mark is found, and nothing is known of it
  read_too_seldom,    ///< succeeds, and cannot tell
  disconnected,       ///< before anything
  fault,              ///< before anything
};

/// A stage whose homings go wrong, or that is unplugged when it is sent somewhere or on its way.
class HomingStage final : public devices::RotationStage, public devices::HomingReport {
 public:
  HomingStage(devices::RotationStage& inner, devices::Clock& clock)
      : inner_(inner), clock_(clock) {}

  std::map<int, Homing> homings;
  std::function<bool()> unplugged = [] { return false; };
  bool drops_off_on_its_way = false;  ///< once, a tenth of a second after it set out

  const std::string& name() const override { return inner_.name(); }
  devices::JointLimits limits() const override { return inner_.limits(); }
  void home(std::chrono::milliseconds timeout) override {
    const auto planned = homings.find(++homed_);
    last_ = planned == homings.end() ? Homing::as_it_should : planned->second;
    if (last_ == Homing::disconnected) throw DeviceError(DeviceErrc::Disconnected, name(), "away");
    if (last_ == Homing::fault) throw DeviceError(DeviceErrc::Fault, name(), "alarm 7");
    inner_.home(timeout);
    if (last_ == Homing::answer_lost || last_ == Homing::answer_lost_early) {
      throw DeviceError(DeviceErrc::Protocol, name(), "wrong checksum");
    }
  }
  void begin_move_to(Angle target) override {
    if (unplugged()) throw DeviceError(DeviceErrc::Disconnected, name(), "unplugged");
    inner_.begin_move_to(target);
    sent_ = true;
  }
  Angle wait_until_settled(std::chrono::milliseconds timeout) override {
    if (std::exchange(sent_, false) && std::exchange(drops_off_on_its_way, false)) {
      clock_.wait_until(clock_.now() + std::chrono::milliseconds(100));
      away_until_ = clock_.now() + std::chrono::seconds(1);
    }
    require_there();
    return inner_.wait_until_settled(timeout);
  }
  void stop() noexcept override { inner_.stop(); }
  void rearm() override {
    require_there();
    inner_.rearm();
  }
  bool tells() const override { return true; }
  std::optional<devices::StoodBeforeHome> stood_before_home() const override {
    if (last_ != Homing::as_it_should && last_ != Homing::answer_lost) return std::nullopt;
    return dynamic_cast<const devices::HomingReport&>(inner_).stood_before_home();
  }

 private:
  void require_there() const {
    if (clock_.now() >= away_until_) return;
    throw DeviceError(DeviceErrc::Disconnected, name(), "unplugged");
  }

  devices::RotationStage& inner_;
  devices::Clock& clock_;
  int homed_ = 0;
  bool sent_ = false;
  std::chrono::nanoseconds away_until_{0};
  Homing last_ = Homing::as_it_should;
};

/// Twelve points with a check every four. Homing 1 is that of the beginning.
class HomeDeltas : public SteadySession {
 protected:
  HomeDeltas() { options_.sentinel_every = 4; }

  acquisition::DeviceSet devices(sim::SimGoniometer& world) const override {
    acquisition::DeviceSet set = SteadySession::devices(world);
    stages_.clear();
    for (std::size_t axis = 0; axis < set.stages.size(); ++axis) {
      stages_.push_back(std::make_unique<HomingStage>(*set.stages[axis], world.clock()));
      const auto planned = homings_.find(axis);
      if (planned != homings_.end()) stages_.back()->homings = planned->second;
      set.stages[axis] = stages_.back().get();
    }
    return set;
  }

  std::vector<std::string> notes(const std::string& kind) const { return notes_of(session_, kind); }
  std::vector<std::string> suspects() const { return notes(acquisition::kSuspectNote); }
  std::vector<std::string> deltas() const { return notes(acquisition::kHomeDeltaNote); }

  /// Runs the session; the turned axis slips once so many points are done.
  acquisition::SessionResult begin_slipping_at(int done) {
    sim::SimGoniometer world(world_);
    acquisition::SessionWriter archive(session_, {{"sample_id", "plate"}}, {});
    bool slipped = false;
    return run(world, archive, [&](const acquisition::SessionProgress& now) {
      if (on_progress_) on_progress_(now);
      if (now.done != done || std::exchange(slipped, true)) return;
      world.joint(kTurnedAxis).lose_steps(kSlip);
    });
  }

  static constexpr std::size_t kOtherAxis = 2;  ///< homed after the turned one
  std::map<std::size_t, std::map<int, Homing>> homings_;
  Progress on_progress_;
  mutable std::vector<std::unique_ptr<HomingStage>> stages_;
  TemporaryFolder folder_;
  std::filesystem::path session_ = folder_.path() / "session";
};

TEST_F(HomeDeltas, ASlipIsFoundThoughTheAnswerOfTheHomingThatFoundItIsLost) {
  homings_[kTurnedAxis] = {{2, Homing::answer_lost}};
  EXPECT_TRUE(begin_slipping_at(2).complete);
  EXPECT_THAT(notes("retry"), ElementsAre(HasSubstr("wrong checksum")));
  EXPECT_THAT(suspects(),
              ElementsAre(AllOf(StartsWith("points 0 1 2 3: "), HasSubstr("+0.0500 deg"))));
}

TEST_F(HomeDeltas, PointsBeforeAHomingThatMayHaveHiddenASlipAreSuspect) {
  homings_[kTurnedAxis] = {{2, Homing::answer_lost_early}};
  EXPECT_TRUE(begin_slipping_at(2).complete);
  ASSERT_THAT(deltas(), Not(IsEmpty()));
  EXPECT_THAT(deltas().front(), HasSubstr("could not tell"));
  EXPECT_FALSE(acquisition::compares_all_axes(deltas().front()));
  EXPECT_TRUE(acquisition::compares_all_axes(deltas().back()));
  EXPECT_THAT(suspects(), ElementsAre(HasSubstr("an axis could not tell")));
}

TEST_F(HomeDeltas, ASlipIsFoundThoughAnotherAxisDropsOffBeforeAllAreHomed) {
  homings_[kOtherAxis] = {{2, Homing::disconnected}};
  on_progress_ = [this, gone = false](const acquisition::SessionProgress& now) mutable {
    if (now.phase != "point" || now.done != 3 || std::exchange(gone, true)) return;
    stages_[kOtherAxis]->unplugged = [moves = 0]() mutable { return moves++ == 0; };
  };
  EXPECT_TRUE(begin_slipping_at(2).complete);
  EXPECT_THAT(notes(acquisition::kCameBackNote), SizeIs(1));
  EXPECT_THAT(suspects(),
              ElementsAre(AllOf(StartsWith("points 0 1 2: "), HasSubstr("+0.0500 deg"))));
}

class DropsOffOnItsWay : public HomeDeltas, public testing::WithParamInterface<bool> {};

// The turned axis has gone some way from where it was read last when the other drops off.
TEST_P(DropsOffOnItsWay, IsNoSlipOfTheAxesThatStay) {
  const bool slips = GetParam();
  on_progress_ = [this, gone = false](const acquisition::SessionProgress& now) mutable {
    if (now.phase != "point" || now.done != 3 || std::exchange(gone, true)) return;
    stages_[kOtherAxis]->drops_off_on_its_way = true;
  };
  EXPECT_TRUE(begin_slipping_at(slips ? 2 : -1).complete);
  ASSERT_THAT(notes(acquisition::kCameBackNote), SizeIs(1));
  if (slips) {
    EXPECT_THAT(suspects(),
                ElementsAre(AllOf(StartsWith("points 0 1 2: "), HasSubstr("+0.0500 deg"))));
  } else {
    EXPECT_THAT(suspects(), IsEmpty());
  }
}

INSTANTIATE_TEST_SUITE_P(Slips, DropsOffOnItsWay, testing::Bool());

TEST_F(HomeDeltas, ASlipIsFoundThoughAnotherAxisDropsOffInACheck) {
  homings_[kOtherAxis] = {{2, Homing::disconnected}, {3, Homing::disconnected}};
  EXPECT_TRUE(begin_slipping_at(2).complete);
  EXPECT_THAT(notes(acquisition::kCameBackNote), SizeIs(1));
  EXPECT_THAT(suspects(),
              ElementsAre(AllOf(StartsWith("points 0 1 2 3: "), HasSubstr("+0.0500 deg"))));
}

TEST_F(HomeDeltas, ASlipIsFoundThoughTheSessionEndsInTheCheck) {
  homings_[kOtherAxis] = {{2, Homing::fault}};
  EXPECT_THROW(begin_slipping_at(2), DeviceError);
  EXPECT_THAT(suspects(), ElementsAre(StartsWith("points 0 1 2 3: ")));
  ASSERT_THAT(deltas(), Not(IsEmpty()));
  EXPECT_FALSE(acquisition::compares_all_axes(deltas().back()));
}

TEST_F(HomeDeltas, ASlipOverAnOutageIsFoundThoughTheNextPartEndsInItsHoming) {
  turned_meanwhile_ = kSlip;
  interrupt_and_resume(session_, [this] {
    homings_[kOtherAxis] = {{1, Homing::fault}};
    EXPECT_THROW(resume(session_), DeviceError);
    homings_.clear();
    turned_meanwhile_ = Angle();
  });
  EXPECT_THAT(suspects(), ElementsAre(AllOf(StartsWith("points 4 5: "), HasSubstr("+0.0500 deg"))));
}

TEST_F(HomeDeltas, PointsThatNoHomingCouldJudgeAreSuspectThemselves) {
  homings_[kTurnedAxis] = {{2, Homing::read_too_seldom}};
  EXPECT_TRUE(begin_slipping_at(6).complete);
  ASSERT_THAT(deltas(), Not(IsEmpty()));
  EXPECT_THAT(deltas().front(), HasSubstr("could not tell"));
  EXPECT_THAT(suspects(), ElementsAre(StartsWith("points 0 1 2 3: an axis could not tell"),
                                      AllOf(StartsWith("points "), HasSubstr("+0.0500 deg"))));
}

TEST_F(HomeDeltas, AStepOfTheLightIsNoReasonToSuspectWhatASentinelHasChecked) {
  const std::filesystem::path whole = folder_.path() / "whole";
  begin(whole);
  homings_[kTurnedAxis] = {{2, Homing::read_too_seldom}};
  const auto at = SessionReader(whole).points().at(5).finished_at + std::chrono::milliseconds(1);
  world_.lamp.events = {{at, {}, 1.03, false}};
  EXPECT_TRUE(begin(session_).complete);
  EXPECT_THAT(suspects(),
              ElementsAre(StartsWith("points 0 1 2 3: an axis could not tell"),
                          AllOf(StartsWith("points 0 1 2 3: "), HasSubstr("sentinel changed"))))
      << "which are measured again next, and before the sentinel comes again";
}

TEST_F(HomeDeltas, WhatAnOutageCouldNotTellIsSuspectWhenALaterCheckFindsASlip) {
  turned_meanwhile_ = 5.0_deg;  // was on its way
  std::stop_source pause;
  interrupt_and_resume(session_, [&] {
    // A part that ends as soon as it has homed.
    resume(
        session_,
        [&](const acquisition::SessionProgress& now) {
          if (now.phase == "white") pause.request_stop();
        },
        pause.get_token());
    ASSERT_THAT(deltas(), Not(IsEmpty()));
    EXPECT_THAT(deltas().back(), HasSubstr("was on its way"));
    EXPECT_THAT(acquisition::resume_state(SessionReader(session_)).unchecked, ElementsAre(4, 5));
    turned_meanwhile_ = kSlip;
  });
  EXPECT_THAT(suspects(), ElementsAre(StartsWith("points 4 5: ")));
}

TEST_F(HomeDeltas, RigsThatCannotTellCompareNothing) {
  for (sim::AxisOptions& axis : world_.axes) axis.tells_home_delta = false;
  const std::filesystem::path bare = folder_.path() / "bare";
  sim::SimGoniometer world(world_);
  {
    acquisition::SessionWriter archive(bare, {}, {});
    EXPECT_TRUE(acquisition::run_session(SteadySession::devices(world), known_, plan_, options_,
                                         archive, {}, {})
                    .complete);
  }
  session_ = bare;
  ASSERT_THAT(deltas(), SizeIs(1));
  EXPECT_THAT(deltas().front(), HasSubstr("cannot tell"));
  EXPECT_FALSE(acquisition::compares_all_axes(deltas().front()));
  EXPECT_THAT(notes(acquisition::kSentinelNote), SizeIs(4)) << "and check with the sentinel alone";
}

}  // namespace
}  // namespace gonio
