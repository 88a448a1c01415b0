// Another target in the holder than a step asks for: refused by the step itself, not by a later one
// that would blame something else, and what there was before stays.

#include <gmock/gmock.h>

#include <filesystem>

#include "careless_changer.h"
#include "finished_run.h"
#include "gonio/calibration/result/step_refused.h"
#include "hidden_bench.h"
#include "temporary_folder.h"

namespace gonio::calibration::routine {
namespace {

using devices::Target;
using ::testing::HasSubstr;

struct WrongTarget {
  const char* step;
  Target asked;
  Target given;
  const char* says;
};

void PrintTo(const WrongTarget& wrong, std::ostream* out) {
  *out << wrong.step << " with " << devices::to_string(wrong.given);
}

class WrongTargets : public ::testing::TestWithParam<WrongTarget> {};

TEST_P(WrongTargets, AreRefusedByTheStepItself) {
  const auto& [step, asked, given, says] = GetParam();
  const TemporaryFolder temporary;
  const Folder folder{temporary.path() / "cal"};
  std::filesystem::copy(test::finished_run().folder.path, folder.path,
                        std::filesystem::copy_options::recursive);
  test::HiddenBench bench(test::another_day());
  test::CarelessChanger changer(*bench.devices.changer, asked, given);
  bench.devices.changer = &changer;
  const auto now = test::kCalibrated + std::chrono::hours(1);
  Routine routine = test::reopened(folder, now);
  EXPECT_THAT([&] { routine.take(step, bench.devices, {}, {}); },
              testing::ThrowsMessage<StepRefused>(HasSubstr(says)));
  EXPECT_EQ(test::reopened(folder, now).state_of(step), instrument::StepState::valid);

  changer.give(asked);
  EXPECT_NO_THROW(routine.take(step, bench.devices, {}, {}));
}

constexpr const char* kNoWhite = "is the white mounted, clean and wholly lit?";
constexpr const char* kOtherConstant = "times that of flat_field";
constexpr const char* kNoTrap = "expected a black trap";

INSTANTIATE_TEST_SUITE_P(
    Routine, WrongTargets,
    testing::Values(WrongTarget{"warm_up", Target::white, Target::board, kNoWhite},
                    WrongTarget{"warm_up", Target::white, Target::black_trap, kNoWhite},
                    WrongTarget{"linearity", Target::white, Target::colour_chart, kNoWhite},
                    WrongTarget{"photon_transfer", Target::white, Target::board, kNoWhite},
                    WrongTarget{"photon_transfer", Target::white, Target::mirror, ""},
                    WrongTarget{"bad_pixels", Target::white, Target::colour_chart, kNoWhite},
                    WrongTarget{"white", Target::white, Target::board, kOtherConstant},
                    WrongTarget{"white", Target::white, Target::colour_chart, kOtherConstant},
                    WrongTarget{"white", Target::white, Target::sample, kOtherConstant},
                    WrongTarget{"stray_light", Target::black_trap, Target::mirror, kNoTrap},
                    WrongTarget{"stray_light", Target::black_trap, Target::black_glass, kNoTrap}));

}  // namespace
}  // namespace gonio::calibration::routine
