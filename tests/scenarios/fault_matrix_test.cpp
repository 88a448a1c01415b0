// Every cell of docs/fault_matrix.csv that simulated devices can show: a fault in a phase of a
// session has its declared outcome in time, leaves the rig safe and the archive readable, and once
// it is gone the session comes to its end with the samples of an undisturbed one.

#include "fault_outcomes.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cerrno>
#include <memory>
#include <set>

#include "faulty_devices.h"
#include "recorded_disk.h"
#include "run_sql.h"
#include "steady_session.h"

namespace gonio {
namespace {

using acquisition::Reduction;
using acquisition::SessionProgress;
using acquisition::SessionReader;
using devices::DeviceErrc;
using Time = std::chrono::nanoseconds;
using namespace gonio::literals;

const std::vector<std::array<double, 3>> kFourDirections(kTwelveDirections.begin() + 4,
                                                         kTwelveDirections.begin() + 8);
constexpr std::size_t kFaultyAxis = 1;
/// What lasts "during the phase" strikes at every opportunity.
constexpr int kEveryTime = 100000;
/// Of a point's mean, when a frame of it or its white was taken again: noise of other frames.
constexpr double kSameWithin = 0.01;

/// Beginning and end of every phase of an undisturbed session.
struct PhaseTimes {
  std::map<std::string, Time> begins;
  std::map<std::string, Time> ends;

  void on_progress(const SessionProgress& now, Time at) {
    if (!under_way_.empty()) ends.try_emplace(under_way_, at);
    under_way_ = begins.contains(now.phase) || !is_beginning(now, now.phase) ? "" : now.phase;
    if (!under_way_.empty()) begins[now.phase] = at;
  }
  void end(Time at) { ends.try_emplace(under_way_, at); }

 private:
  std::string under_way_;
};

class FaultMatrix : public SteadySession, public testing::WithParamInterface<FaultCell> {
 protected:
  FaultMatrix() {
    plan_ = plan_of(known_, kFourDirections);
    options_.sentinel_every = 2;
  }

  static void SetUpTestSuite();
  static void TearDownTestSuite() { untroubled_.reset(); }

  /// The session that others are compared with.
  class FaultMatrixReference;

  acquisition::DeviceSet devices(sim::SimGoniometer& world) const override {
    acquisition::DeviceSet set = SteadySession::devices(world);
    if (armed_) arm(set);
    return set;
  }

  void arm(acquisition::DeviceSet& set) const;
  void break_world();

  /// The session with the fault.
  FirstPart run_with_fault() {
    sim::SimGoniometer world(world_);
    std::optional<Time> interrupted;
    std::stop_source pause;
    std::stop_source stop;
    acquisition::SessionPart session_part;
    session_part.pause = pause.get_token();
    const auto progress = [&](const SessionProgress& now) {
      if (strikes_) strikes_->on_progress(now);
      if (!is_beginning(now, cell_.phase)) return;
      if (cell_.fault == "asked to pause") pause.request_stop();
      if (cell_.fault == "asked to stop") stop.request_stop();
      if (cell_.row == "interrupted" && !interrupted) interrupted = world.clock().now();
    };
    FirstPart part = first_part(
        [&] {
          acquisition::SessionWriter archive(session_, {{"sample_id", "plate"}}, {});
          return run(world, archive, progress, session_part, stop.get_token());
        },
        [&] { return world.clock().now(); });
    part.struck = interrupted;
    if (strikes_) part.struck = strikes_->first();
    if (struck_world_) part.struck = struck_world_;
    strikes_.reset();
    return part;
  }

  /// The archive as it was at this moment of an undisturbed session: in the middle of the phase, or
  /// at its end.
  enum class Moment { middle, end };
  void cut(Moment moment, RecordedDisk::Loss loss) const {
    const TemporaryFolder folder;
    RecordedDisk disk(folder.path() / "whole");
    std::size_t from = 0;
    std::size_t until = 0;
    begin(folder.path() / "whole", [&](const SessionProgress& now) {
      if (from == 0 && is_beginning(now, cell_.phase)) {
        from = disk.count();
      } else if (from != 0 && until == 0) {
        until = disk.count();
      }
    });
    if (until == 0) until = disk.count();
    ASSERT_GT(from, 0U);
    disk.restore(moment == Moment::middle ? (from + until) / 2 : until, loss, from, session_);
  }

  SessionUnderFault checked() const {
    return {cell_, session_, plan_.points.size(), 1.0, [this] { return reduced(session_); }};
  }

  FaultCell cell_;
  TemporaryFolder folder_;
  std::filesystem::path session_ = folder_.path() / "session";

  bool armed_ = false;
  mutable std::optional<Strikes> strikes_;
  mutable std::unique_ptr<FaultyStage> stage_;
  mutable std::unique_ptr<FaultyCamera> camera_;
  mutable std::unique_ptr<FaultyLight> light_;
  mutable std::unique_ptr<FaultyMonitor> monitor_;
  mutable std::unique_ptr<FaultyChanger> changer_;
  std::optional<Time> struck_world_;

  static std::unique_ptr<TemporaryFolder> untroubled_;
  static PhaseTimes times_;
  static Reduction wanted_;
};

std::unique_ptr<TemporaryFolder> FaultMatrix::untroubled_;
PhaseTimes FaultMatrix::times_;
Reduction FaultMatrix::wanted_;

class FaultMatrix::FaultMatrixReference : public FaultMatrix {
 public:
  void make() {
    sim::SimGoniometer world(world_);
    acquisition::SessionWriter archive(untroubled_->path() / "session", {}, {});
    const auto result = run(world, archive, [&](const SessionProgress& now) {
      times_.on_progress(now, world.clock().now());
    });
    times_.end(world.clock().now());
    EXPECT_TRUE(result.complete);
    wanted_ = reduced(untroubled_->path() / "session");
  }

 private:
  void TestBody() override {}
};

void FaultMatrix::SetUpTestSuite() {
  untroubled_ = std::make_unique<TemporaryFolder>();
  FaultMatrixReference().make();
}

/// Code of a device's error, and what it says.
std::optional<Misdeed> error_of(const std::string& fault) {
  static const std::map<std::string, std::pair<DeviceErrc, std::string>> kErrors{
      {"disconnected", {DeviceErrc::Disconnected, "unplugged"}},
      {"lost its home", {DeviceErrc::NotHomed, "was without power"}},
      {"no answer", {DeviceErrc::Timeout, "no answer"}},
      {"broken answer", {DeviceErrc::Protocol, "wrong checksum"}},
      {"exception", {DeviceErrc::Fault, "refused: device failure (04)"}},
      {"alarm", {DeviceErrc::Fault, "the drive's alarm 7"}},
      {"limit switch", {DeviceErrc::Fault, "not in position (limit switch)"}},
      {"following error", {DeviceErrc::Fault, "following error 1.2 deg"}},
      {"not in position", {DeviceErrc::Timeout, "not in position"}},
      {"lost packets", {DeviceErrc::Protocol, "12 packets are missing"}}};
  const auto found = kErrors.find(fault);
  if (found == kErrors.end()) return std::nullopt;
  return throws(found->second.first, found->second.second);
}

std::optional<FaultyCamera::Spoil> spoilt_frame(const std::string& fault) {
  static const std::map<std::string, FaultyCamera::Spoil> kSpoils{
      {"incomplete frame", [](auto& frame) { frame.pixels_dn.resize(frame.pixels_dn.size() / 2); }},
      {"frame id twice",
       [stays = std::optional<std::uint64_t>()](auto& frame) mutable {
         if (!stays) stays = frame.frame_id - 1;
         frame.frame_id = *stays;
       }},
      {"wrong exposure", [](auto& frame) { frame.exposure = frame.exposure * 3 / 2; }},
      {"other gain", [](auto& frame) { frame.gain_db += 3.0; }},
      {"other black level", [](auto& frame) { frame.black_level_dn += 10.0; }},
      {"other pixel format",
       [](auto& frame) { frame.pixel_format = devices::PixelFormat::bayer_rggb; }},
      {"saturated in every exposure",
       [](auto& frame) { std::fill(frame.pixels_dn.begin(), frame.pixels_dn.end(), 4095); }},
      {"too dark in every exposure",
       [](auto& frame) { std::fill(frame.pixels_dn.begin(), frame.pixels_dn.end(), 64); }}};
  const auto found = kSpoils.find(fault);
  if (found == kSpoils.end()) return std::nullopt;
  return found->second;
}

std::vector<StageCall> calls_of(const std::string& fault) {
  if (fault == "lost its home") return {StageCall::move};
  if (fault == "alarm") return {StageCall::home, StageCall::move};
  if (fault == "limit switch" || fault == "following error" || fault == "not in position" ||
      fault == "stands elsewhere") {
    return {StageCall::settle};
  }
  return {StageCall::home, StageCall::move, StageCall::settle};
}

int count_of(const std::string& lasts) {
  if (lasts == "once") return 1;
  if (lasts == "three times") return 3;
  return lasts == "until mended" ? Strikes::kForEver : kEveryTime;
}

void FaultMatrix::arm(acquisition::DeviceSet& set) const {
  const std::optional<Misdeed> error = error_of(cell_.fault);
  // A camera's first frame is what its later ones are compared with.
  const int skip = cell_.device == "camera" && cell_.lasts != "during the phase" ? 1 : 0;
  strikes_.emplace(cell_.phase, count_of(cell_.lasts), skip, *set.clock);
  if (cell_.device == "stage") {
    devices::RotationStage*& stage = set.stages.at(kFaultyAxis);
    stage_ = std::make_unique<FaultyStage>(*stage, *strikes_, calls_of(cell_.fault),
                                           error.value_or(Misdeed()));
    if (!error) stage_->reads_off = 0.2_deg;
    stage = stage_.get();
  } else if (cell_.device == "camera") {
    const auto spoil = spoilt_frame(cell_.fault);
    ASSERT_TRUE(error || spoil) << "no such fault: " << cell_.fault;
    camera_ = std::make_unique<FaultyCamera>(*set.camera, *strikes_, error.value_or(Misdeed()),
                                             spoil.value_or(FaultyCamera::Spoil()));
    set.camera = camera_.get();
  } else {
    ASSERT_TRUE(error) << "no such fault: " << cell_.fault;
    if (cell_.device == "lamp") {
      light_ = std::make_unique<FaultyLight>(*set.light, *strikes_, *error);
      set.light = light_.get();
    } else if (cell_.device == "monitor") {
      monitor_ = std::make_unique<FaultyMonitor>(*set.monitor, *strikes_, *error);
      set.monitor = monitor_.get();
    } else {
      ASSERT_EQ(cell_.device, "changer");
      changer_ = std::make_unique<FaultyChanger>(*set.changer, *strikes_, *error);
      set.changer = changer_.get();
    }
  }
}

/// Lights and axes as they are from the beginning of the phase on.
void FaultMatrix::break_world() {
  const Time at = times_.begins.at(cell_.phase) + std::chrono::milliseconds(1);
  const Time end = times_.ends.at("park");
  std::vector<sim::LampEvent>& events = world_.lamp.events;
  struck_world_ = at;
  if (cell_.row == "lost steps") {
    world_.axes[kFaultyAxis].slip = 0.05_deg;
    world_.axes[kFaultyAxis].slips_at = at;
  } else if (cell_.fault == "off") {
    events = {{at, {}, 0.0, true}};
  } else if (cell_.fault == "off beside its monitor") {
    events = {{at, {}, 0.0, false}};
  } else if (cell_.fault == "3 % brighter beside its monitor") {
    events = {{at, {}, 1.03, false}};
  } else if (cell_.fault == "4 % drift beside its monitor") {
    // From one sentinel to the next half of what would be a step: noise must not decide.
    events = {{at, end, 1.04, false}};
  } else if (cell_.fault == "room light goes on") {
    world_.scene.ambient_steps = {{at, 0.01}};
  } else {
    FAIL() << "no such fault: " << cell_.fault;
  }
}

TEST_P(FaultMatrix, EndsAsDeclared) {
  cell_ = GetParam();
  const sim::SimOptions healthy = world_;
  if (cell_.row == "killed") {
    cut(Moment::middle, cell_.fault == "power cut" ? RecordedDisk::Loss::unsynced
                        : cell_.fault == "killed"  ? RecordedDisk::Loss::nothing
                                                   : RecordedDisk::Loss::half_write);
    const acquisition::ResumeState state = acquisition::resume_state(SessionReader(session_));
    EXPECT_THAT(state.again, testing::IsEmpty());
    EXPECT_TRUE(state.finished || resume(session_).complete);
    EXPECT_EQ(SessionReader(session_).points().size(), plan_.points.size());
  } else if (cell_.row == "record") {
    cut(Moment::end, RecordedDisk::Loss::nothing);
    const acquisition::FrameRecord last = SessionReader(session_).frames().back();
    if (cell_.fault == "altered frame") {
      std::filesystem::resize_file(session_ / last.file, 100);
    } else {
      acquisition::run_sql(session_,
                           "DROP TRIGGER frames_no_UPDATE; UPDATE frames SET monitor = '2' "
                           "WHERE number = " +
                               std::to_string(last.id) + ";");
    }
    const SessionReader damaged(session_);
    EXPECT_THAT(damaged.damage(), testing::SizeIs(1));
    EXPECT_EQ(acquisition::resume_state(damaged).again.size(), last.point >= 0 ? 1U : 0U);
    EXPECT_TRUE(resume(session_).complete);
  } else {
    std::unique_ptr<RecordedDisk> disk;
    if (cell_.row == "disk") {
      // Where an undisturbed session is when the phase begins.
      std::size_t from = 0;
      {
        const TemporaryFolder folder;
        RecordedDisk undisturbed(folder.path() / "whole");
        begin(folder.path() / "whole", [&](const SessionProgress& now) {
          if (from == 0 && is_beginning(now, cell_.phase)) from = undisturbed.count();
        });
      }
      disk = std::make_unique<RecordedDisk>(session_);
      disk->fail_from(from, cell_.fault == "disk full" ? ENOSPC : EIO);
    } else if (cell_.row == "lamp" || cell_.row == "room" || cell_.row == "lost steps") {
      break_world();
    } else {
      armed_ = cell_.row != "interrupted";
    }
    const FirstPart part = run_with_fault();
    if (cell_.row != "disk") {
      ASSERT_TRUE(part.struck) << "nothing was struck: the cell cannot be";
    }
    disk.reset();
    armed_ = false;
    world_ = healthy;
    EXPECT_THAT(SessionReader(session_).damage(), testing::IsEmpty());
    checked().expect_outcome(part);
    if (!SessionReader(session_).finished()) {
      EXPECT_TRUE(resume(session_).complete);
    }
  }
  EXPECT_TRUE(SessionReader(session_).finished());
  checked().expect_good_samples(wanted_, kSameWithin);
}

INSTANTIATE_TEST_SUITE_P(Simulated, FaultMatrix, testing::ValuesIn(possible_cells("simulated")),
                         name_of_cell);

TEST(FaultMatrixTable, HasEveryFaultInEveryPhase) {
  const std::set<std::string> rows{"killed",     "interrupted", "drops off", "bus",   "drive",
                                   "lost steps", "frame",       "settings",  "range", "lamp",
                                   "room",       "disk",        "record",    "input"};
  const std::set<std::string> outcomes{"-",           "resumed", "paused",  "stopped",  "complete",
                                       "redone",      "ended",   "retried", "suspect",  "said",
                                       "taken again", "flagged", "bridged", "harmless", "refused"};
  std::set<std::string> found;
  std::set<std::string> names;
  for (const FaultCell& cell : fault_matrix()) {
    SCOPED_TRACE(cell.name());
    found.insert(cell.row);
    EXPECT_TRUE(names.insert(cell.over + cell.name()).second) << "stands twice";
    EXPECT_TRUE(outcomes.contains(cell.outcome)) << cell.outcome;
    EXPECT_THAT(cell.over, testing::AnyOf("simulated", "wire", "program"));
    EXPECT_TRUE(cell.is_possible() || !cell.dash_because.empty());
  }
  EXPECT_EQ(found, rows);
}

}  // namespace
}  // namespace gonio
