// The cells of docs/fault_matrix.csv that the program shows: malformed input is refused in one line
// that names it, before anything moves or is begun.

#include "fault_matrix.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <map>

#include "workflow.h"

namespace gonio {
namespace {

class FaultMatrixRefusals : public Workflow, public testing::WithParamInterface<FaultCell> {};

TEST_P(FaultMatrixRefusals, NameWhatIsMalformedAndBeginNothing) {
  const std::vector<std::string> measure{"measure", "rig.toml",   "--simulate",
                                         "--plan",  "list.csv",   "--out",
                                         "session", "--material", "grey.binary"};
  struct Malformed {
    std::string file;
    std::string contents;
    std::vector<std::string> command;
  };
  std::vector<std::string> calibrated = measure;
  calibrated.back() = "builtin:grey-abs";
  std::vector<std::string> plain = calibrated;
  calibrated.insert(calibrated.end(), {"--calibration", "constants.json"});
  const std::map<std::string, Malformed> faults{
      {"malformed rig file", {"rig.toml", "[camera]\nwidth_px = \"wide\"\n", plain}},
      {"malformed plan", {"list.csv", "theta_h_deg,theta_d_deg,phi_d_deg\n3,twelve,28\n", plain}},
      {"malformed material", {"grey.binary", "no table", measure}},
      {"malformed basis",
       {"basis.h5",
        "no basis",
        {"plan", "--basis", "basis.h5", "--samples", "3", "--out", "session"}}},
      {"malformed calibration", {"constants.json", "{\"camera\": 3", calibrated}}};
  const Malformed& malformed = faults.at(GetParam().fault);
  folder.write(malformed.file, malformed.contents);
  const Ended ended = run_gonio(malformed.command, folder.path());
  EXPECT_EQ(ended.exit_code, 2) << ended.error;
  EXPECT_THAT(ended.error, testing::HasSubstr(malformed.file));
  EXPECT_LE(std::count(ended.error.begin(), ended.error.end(), '\n'), 2) << ended.error;
  EXPECT_FALSE(std::filesystem::exists(folder / "session"));
}

INSTANTIATE_TEST_SUITE_P(Program, FaultMatrixRefusals, testing::ValuesIn(possible_cells("program")),
                         name_of_cell);

}  // namespace
}  // namespace gonio
