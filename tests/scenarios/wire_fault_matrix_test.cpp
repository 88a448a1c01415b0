// Every cell of docs/fault_matrix.csv that the emulated machine can show: the drivers meet the
// fault on their wire in a phase of a session, which has its declared outcome in time and leaves
// the emulated machine safe and the archive readable; once the fault is gone the session comes to
// its end with the samples of an undisturbed one.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>
#include <memory>
#include <string_view>

#include "emulated_machine.h"
#include "fault_outcomes.h"
#include "gonio/acquisition/resume.h"
#include "gonio/devices/resettable_alarm.h"
#include "gonio/opened_rig/watchdog.h"
#include "gonio/setup/simulated_rig.h"
#include "private_loopback.h"
#include "simulated_session.h"
#include "temporary_folder.h"

namespace gonio {
namespace {

using acquisition::Reduction;
using acquisition::SessionProgress;
using acquisition::SessionReader;

const std::vector<std::array<double, 3>> kTwoDirections{{20.0, 20.0, 60.0}, {10.0, 25.0, 90.0}};
constexpr double kSameWithin = 0.02;

/// Device of the matrix -> the rig file's.
const std::map<std::string, std::string> kDevices{
    {"serial stage", "lamp_arm"}, {"USB stage", "tilt"}, {"lamp", "lamp"},
    {"monitor", "monitor"},       {"camera", "camera"},  {"changer", "changer"}};

/// Fault of the matrix -> the emulators'.
std::string rule_of(const FaultCell& cell) {
  static const std::map<std::string, std::string> kFaults{{"no answer", "dead_link"},
                                                          {"exception", "exception"},
                                                          {"wrong checksum", "crc_error"},
                                                          {"late answer", "late_reply"},
                                                          {"torn answer", "torn_reply"},
                                                          {"another's answer", "foreign_reply"},
                                                          {"stalled endpoint", "stall"},
                                                          {"unplugged", "unplug"},
                                                          {"alarm", "alarm"},
                                                          {"not in position", "never_in_position"},
                                                          {"command not heard", "lost_move"},
                                                          {"power lost", "power_cycle"},
                                                          {"lost packets", "lost_packets"},
                                                          {"wrong exposure", "wrong_exposure"},
                                                          {"frame id twice", "duplicate_frame_id"},
                                                          {"no frame", "no_frame"},
                                                          {"vanished", "dead_link"}};
  const std::string count = cell.lasts == "once" ? ":count=1" : "";
  return kFaults.at(cell.fault) + "@" + kDevices.at(cell.device) + count;
}

class WireFaultMatrix : public testing::TestWithParam<FaultCell> {
 protected:
  using Progress = std::function<void(const SessionProgress&)>;

  static void SetUpTestSuite() {
    const TemporaryFolder folder;
    EmulatedMachine machine(rig(), 1);
    DrivenMachine driven(rig());
    acquisition::SessionWriter archive(folder.path() / "session", {}, {});
    EXPECT_TRUE(run(driven, archive).complete);
    wanted_ = reduced(folder.path() / "session");
  }

  static const cli::RigFile& rig() {
    static const cli::RigFile small = small_emulated_rig();
    return small;
  }
  static const instrument::Instrument& known() {
    static const instrument::Instrument nominal = cli::nominal_instrument(rig());
    return nominal;
  }
  static const acquisition::MeasurementPlan& plan() {
    static const acquisition::MeasurementPlan two = plan_of(known(), kTwoDirections);
    return two;
  }

  static acquisition::SessionResult run(DrivenMachine& driven, acquisition::SessionWriter& archive,
                                        const Progress& progress = {},
                                        const acquisition::SessionPart& part = {}) {
    return acquisition::run_session(driven.devices(), known(), plan(), rig().session, archive,
                                    progress, {}, part);
  }

  static Reduction reduced(const std::filesystem::path& session) {
    return acquisition::reduce(SessionReader(session), known(), rig().reduction);
  }

  /// The session with the fault.
  FirstPart run_with_fault(EmulatedMachine& machine, DrivenMachine& driven) const {
    acquisition::SessionWriter archive(session_, {{"sample_id", "plate"}}, {});
    devices::Clock& clock = *driven.devices().clock;
    bool begun = false;
    const auto progress = [&](const SessionProgress& now) {
      if (!begun && is_beginning(now, cell_.phase)) {
        begun = true;
        machine.faults().add(emulator_faults::fault_rule_from_text(rule_of(cell_)));
      } else if (begun && cell_.lasts == "once") {
        machine.faults().mend();
      }
    };
    FirstPart part =
        first_part([&] { return run(driven, archive, progress); }, [&] { return clock.now(); });
    // Both clocks run at the same pace.
    const auto ahead = clock.now() - machine.world().clock().now();
    if (const auto struck = machine.faults().first_struck()) part.struck = *struck + ahead;
    return part;
  }

  /// In the middle of a fault the axis that has it may be out of reach, and light that cannot be
  /// switched off; all else is safe.
  void expect_safe_but_for_the_faulty_one(EmulatedMachine& machine) const {
    const std::string& faulty = kDevices.at(cell_.device);
    for (const std::size_t axis : machine.moving()) {
      EXPECT_EQ(rig().rig.axes[axis].name, faulty) << "was not stopped";
    }
    if (faulty != "lamp") {
      EXPECT_FALSE(machine.is_lit()) << "the shutter is open";
    }
  }

  void resume(EmulatedMachine& machine) const {
    DrivenMachine driven(rig());
    // As a person does who has looked at it.
    for (devices::RotationStage* stage : driven.devices().stages) {
      if (auto* drive = dynamic_cast<devices::ResettableAlarm*>(stage)) drive->reset_alarm();
    }
    files::ProcessLock lock(acquisition::session_lock(session_));
    const acquisition::ResumeState state = acquisition::resume_state(SessionReader(session_));
    acquisition::SessionWriter archive = acquisition::SessionWriter::resume(
        session_, std::move(lock), state.may_begin_at + std::chrono::seconds(100),
        driven.devices().clock->now(), "in a test");
    EXPECT_TRUE(run(driven, archive, {}, acquisition::part_to_resume(state)).complete);
    driven.require_safe();
    EXPECT_THAT(machine.moving(), testing::IsEmpty());
  }

  const FaultCell& cell_ = GetParam();
  TemporaryFolder folder_;
  std::filesystem::path session_ = folder_.path() / "session";

  static Reduction wanted_;
};

Reduction WireFaultMatrix::wanted_;

TEST_P(WireFaultMatrix, EndsAsDeclared) {
  const SessionUnderFault checked{cell_, session_, plan().points.size(), kEmulatedTimeScale,
                                  [&] { return reduced(session_); }};
  EmulatedMachine machine(rig(), 2);
  {
    DrivenMachine driven(rig());
    const FirstPart part = run_with_fault(machine, driven);
    ASSERT_TRUE(part.struck) << "nothing was struck: the cell cannot be";
    expect_safe_but_for_the_faulty_one(machine);
    machine.faults().mend();
    EXPECT_THAT(SessionReader(session_).damage(), testing::IsEmpty());
    checked.expect_outcome(part);
  }
  EXPECT_THAT(machine.moving(), testing::IsEmpty());
  EXPECT_FALSE(machine.is_lit());
  if (!SessionReader(session_).finished()) resume(machine);
  EXPECT_TRUE(SessionReader(session_).finished());
  EXPECT_FALSE(machine.is_lit());
  checked.expect_good_samples(wanted_, kSameWithin);
}

INSTANTIATE_TEST_SUITE_P(Wire, WireFaultMatrix, testing::ValuesIn(possible_cells("wire")),
                         name_of_cell);

}  // namespace
}  // namespace gonio

int main(int argc, char** argv) {
  // The watchdog of an opened rig is the program itself, started once more.
  if (argc == 2 && std::string_view(argv[1]) == gonio::cli::kWatchdogArgument) {
    return gonio::cli::run_watchdog();
  }
  testing::InitGoogleMock(&argc, argv);
  testing::AddGlobalTestEnvironment(new gonio::PrivateLoopback());
  return RUN_ALL_TESTS();
}
