#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "gonio_process.h"
#include "temporary_folder.h"

namespace gonio {
namespace {

using testing::HasSubstr;

const std::vector<std::string> kSubcommands{
    "demo",     "materials", "train",   "plan",   "rig",         "calibrate",
    "align",    "measure",   "status",  "reduce", "reconstruct", "sample",
    "evaluate", "compare",   "convert", "render", "report",      "completion"};

TEST(CommandLine, ExplainsEverySubcommandWithAnExample) {
  const TemporaryFolder folder;
  const Ended all = run_gonio({"--help"}, folder.path());
  EXPECT_EQ(all.exit_code, 0);
  for (const std::string& name : kSubcommands) {
    EXPECT_THAT(all.out, HasSubstr(name));
    const Ended help = run_gonio({name, "--help"}, folder.path());
    EXPECT_EQ(help.exit_code, 0) << name;
    EXPECT_THAT(help.out, HasSubstr("gonio " + name)) << "no example";
    EXPECT_THAT(help.out, HasSubstr("--threads")) << name;
  }
  EXPECT_THAT(folder.names(), testing::IsEmpty());
}

TEST(CommandLine, SaysItsVersion) {
  const TemporaryFolder folder;
  const Ended ended = run_gonio({"--version"}, folder.path());
  EXPECT_EQ(ended.exit_code, 0);
  EXPECT_THAT(ended.out, testing::StartsWith("gonio 0."));
}

TEST(CommandLine, PointsToTheHelpOfTheCommandThatWasCalled) {
  const TemporaryFolder folder;
  EXPECT_THAT(run_gonio({"rig", "check"}, folder.path()).error,
              HasSubstr("gonio rig check --help"));
}

TEST(CommandLine, RigCheckSaysWhatIsWhereAndWhatNobodyHasConfirmed) {
  const TemporaryFolder folder;
  const Ended ended =
      run_gonio({"rig", "check", std::string(GONIO_RIGS) + "/lab_example.toml"}, folder.path());
  EXPECT_EQ(ended.exit_code, 0) << ended.error;
  EXPECT_THAT(ended.out,
              testing::ContainsRegex("named +lamp_arm +Modbus, leadshine-em2rs, unit 1 "
                                     "on stages .*not confirmed by a manual: stop, home"));
  EXPECT_THAT(ended.out, testing::ContainsRegex("azimuth +Modbus, oriental-az.*need --home"));
  EXPECT_THAT(ended.out, testing::ContainsRegex("tilt +APT, K10CR1 serial 55000001"));
  EXPECT_THAT(ended.out, testing::ContainsRegex("camera +192.168.1.50, Mono12p"));
}

TEST(CommandLine, ARigOfMetalHasNoSeed) {
  const TemporaryFolder folder;
  folder.write("list.csv", "theta_h_deg,theta_d_deg,phi_d_deg\n10,20,90\n");
  for (const char* seed : {"1", "7"}) {
    const Ended ended = run_gonio({"measure", std::string(GONIO_RIGS) + "/lab_example.toml",
                                   "--plan", "list.csv", "--out", "session", "--seed", seed},
                                  folder.path());
    EXPECT_EQ(ended.exit_code, 2);
    EXPECT_THAT(ended.error, HasSubstr("--seed: a rig of metal"));
  }
}

TEST(CommandLine, SuggestsWhatMayHaveBeenMeant) {
  const TemporaryFolder folder;
  const Ended subcommand = run_gonio({"reconstuct"}, folder.path());
  EXPECT_EQ(subcommand.exit_code, 2);
  EXPECT_THAT(subcommand.error, HasSubstr("did you mean \"reconstruct\"?"));
  const Ended option = run_gonio({"train", "builtin", "--componets", "3"}, folder.path());
  EXPECT_EQ(option.exit_code, 2);
  EXPECT_THAT(option.error, HasSubstr("did you mean \"--components\"?"));
  const Ended material = run_gonio({"demo", "--material", "red-pma"}, folder.path());
  EXPECT_EQ(material.exit_code, 2);
  EXPECT_THAT(material.error, HasSubstr("did you mean \"red-pmma\"?"));
}

TEST(CommandLine, CompletesEverySubcommandInBash) {
  const TemporaryFolder folder;
  const Ended ended = run_gonio({"completion", "bash"}, folder.path());
  EXPECT_EQ(ended.exit_code, 0);
  for (const std::string& name : kSubcommands) {
    EXPECT_THAT(ended.out, HasSubstr("    \"" + name + "\") words="));
  }
  EXPECT_THAT(ended.out, HasSubstr("--skip-unreachable"));
}

TEST(CommandLine, ListsTheBuiltInMaterials) {
  const TemporaryFolder folder;
  const Ended ended = run_gonio({"materials", "list"}, folder.path());
  EXPECT_EQ(ended.exit_code, 0);
  EXPECT_THAT(ended.out, HasSubstr("red-pmma"));
}

TEST(CommandLine, PrintsARigFileThatReadsBack) {
  const TemporaryFolder folder;
  const Ended example = run_gonio({"rig", "example"}, folder.path());
  EXPECT_EQ(example.exit_code, 0);
  // Times are whole numbers of their units, not what a division leaves.
  EXPECT_THAT(example.out, HasSubstr("min_exposure_us = 50\n"));
  folder.write("rig.toml", example.out);
  const Ended check = run_gonio({"rig", "check", "rig.toml"}, folder.path());
  EXPECT_EQ(check.exit_code, 0) << check.error;
  EXPECT_THAT(check.out, HasSubstr("10 of 10 reached"));
}

}  // namespace
}  // namespace gonio
