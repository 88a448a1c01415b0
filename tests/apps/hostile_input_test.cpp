// Input that is not only wrong but would hurt: names that act on a terminal, files that never end,
// text that overflows its parser, a disk that is full.

#include <sys/stat.h>
#include <sys/wait.h>

#include <cstdlib>

#include <nlohmann/json.hpp>

#include "bad_input.h"

namespace gonio {
namespace {

using testing::HasSubstr;

class HostileInput : public BadInput {
 protected:
  void SetUp() override {
    folder.write("rig.toml", kSmallRig);
    folder.write("list.csv", kHeader + std::string("3,12,28\n"));
  }

  Ended run(const std::vector<std::string>& arguments) {
    const Ended ended = run_gonio(arguments, folder.path());
    EXPECT_EQ(ended.exit_code, 0) << testing::PrintToString(arguments) << "\n" << ended.error;
    return ended;
  }

  // Small frames, so that a session takes a second.
  static constexpr const char* kSmallRig =
      "[camera]\nwidth_px = 80\nheight_px = 64\nfx_px = 345.0\nfy_px = 345.0\ncx_px = 39.5\n"
      "cy_px = 31.5\n[session]\nwhite_frames = 2\ndark_frames = 2\n";
};

/// What a terminal would obey: C0 without line end and tab, DEL, C1 as UTF-8 and as a bare byte.
bool acts_on_a_terminal(const std::string& text) {
  bool acts = false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const auto byte = static_cast<unsigned char>(text[i]);
    const auto before = static_cast<unsigned char>(i > 0 ? text[i - 1] : 0);
    acts |= (byte < 0x20 && byte != '\n' && byte != '\t') || byte == 0x7f;
    acts |= byte >= 0x80 && byte < 0xa0 && (before < 0x80 || before == 0xc2);
  }
  return acts;
}

TEST_F(HostileInput, ASeedIsAWholeNumber) {
  for (const char* seed : {"-1", "1.5", "1e3", "18446744073709551616", "0x10"}) {
    refused({"sample", "builtin:slate", "--directions", "list.csv", "--out", "x.csv",
             std::string("--seed=") + seed},
            {"--seed", std::string("found ") + seed,
             "expected a whole number from 0 to 18446744073709551615"});
  }
  run({"sample", "builtin:slate", "--directions", "list.csv", "--out", "x.csv", "--seed",
       "18446744073709551615"});
}

TEST_F(HostileInput, ABranchMustBeThatOfTheJoints) {
  run({"plan", "--directions", "list.csv", "--rig", "rig.toml", "--out", "plan.csv"});
  const std::string plan = folder.read("plan.csv");
  const std::size_t branch = plan.find(",A,");
  ASSERT_NE(branch, std::string::npos) << plan;
  const auto measure = [&](const std::string& name) {
    std::string edited = plan;
    edited.replace(branch, 3, "," + name + ",");
    folder.write("edited.csv", edited);
    return std::vector<std::string>{"measure",    "rig.toml",      "--plan", "edited.csv",
                                    "--material", "builtin:slate", "--out",  "session"};
  };
  refused(measure("B"), {"edited.csv: line ", "column branch", "\"B\"", "other lamp side"});
  refused(measure("C"), {"edited.csv: line ", "joints do not realise", "branch C"});
  refused(measure("A'"), {"edited.csv: line ", "joints do not realise", "branch A'"});
  refused(measure("E"), {"edited.csv: line ", "column branch", "\"E\""});
}

TEST_F(HostileInput, NamesNeverActOnTheTerminal) {
  // Red, a cleared screen, a window title, in every encoding that terminals know.
  const std::string acting = "\x1b[31m\x1b[2J\x1b]0;x\x07\x7f\xc2\x9b[1m\r\n";
  const std::string shown = "\\x1b[31m\\x1b[2J\\x1b]0;x\\x07\\x7f\\xc2\\x9b[1m\\r\\n";
  const std::string name = acting + "\x9b.binary";
  folder.write(name, merl_file(10.0));
  const Ended missing = run_gonio({"compare", "builtin:slate", "x" + name}, folder.path());
  EXPECT_EQ(missing.exit_code, 2);
  EXPECT_THAT(missing.error, HasSubstr("gonio: x" + shown + "\\x9b.binary: "));
  EXPECT_FALSE(acts_on_a_terminal(missing.error)) << testing::PrintToString(missing.error);

  for (const auto& arguments :
       {std::vector<std::string>{"measure", "rig.toml", "--plan", "list.csv", "--material", name,
                                 "--out", "session"},
        {"status", "session"},
        {"status", "session", "--json"},
        {"reduce", "session", "--out", "samples.csv"}}) {
    const Ended ended = run(arguments);
    EXPECT_FALSE(acts_on_a_terminal(ended.out)) << testing::PrintToString(ended.out);
    EXPECT_FALSE(acts_on_a_terminal(ended.error)) << testing::PrintToString(ended.error);
  }
  EXPECT_THAT(run({"status", "session"}).out, HasSubstr(shown));
  const auto status = nlohmann::json::parse(run({"status", "session", "--json"}).out);
  EXPECT_THAT(status["metadata"]["sample_id"].get<std::string>(), testing::StartsWith(acting));
}

TEST_F(HostileInput, LabelsAndRigNamesHoldNoControlCharacters) {
  for (const char* option : {"--sample-id", "--operator", "--note"}) {
    refused({"measure", "rig.toml", "--plan", "list.csv", "--material", "builtin:slate", "--out",
             "session", option, "a\x1b[2J\nb"},
            {option, "a\\x1b[2J\\nb", "expected no control characters"});
  }
  folder.write("name.toml", "[rig]\nname = \"a\\u001b[2J\"\n");
  refused({"rig", "check", "name.toml"},
          {"name.toml:2 rig.name", "found \"a\\x1b[2J\"", "expected no control characters"});
}

TEST_F(HostileInput, CellsAreShownNotObeyed) {
  folder.write("cell.csv", kHeader + std::string("3,\xc2\x9b[J,28\n"));
  const Ended ended = run_gonio(
      {"sample", "builtin:slate", "--directions", "cell.csv", "--out", "x.csv"}, folder.path());
  EXPECT_EQ(ended.exit_code, 2);
  EXPECT_THAT(ended.error, HasSubstr("cell.csv: line 2, column theta_d_deg: found '\\xc2\\x9b[J'"));
  EXPECT_FALSE(acts_on_a_terminal(ended.error));
}

TEST_F(HostileInput, WhatIsNoRegularFileIsNotWaitedFor) {
  run({"train", "builtin:slate", "builtin:gold-satin", "builtin:red-pmma", "--out", "basis.h5"});
  run({"sample", "builtin:slate", "--directions", "list.csv", "--out", "samples.csv"});
  folder.write("good.binary", merl_file(1.0));
  // Without anybody who would ever write to it.
  ASSERT_EQ(::mkfifo((folder / "pipe").c_str(), 0600), 0);
  std::filesystem::create_directory(folder / "empty");
  folder.write("calibrated.toml", "[rig]\ncalibration = \"pipe\"\n");
  const std::vector<std::vector<std::string>> commands{
      {"compare", "builtin:slate", "WHAT.binary"},
      {"render", "WHAT.binary", "--out", "x.png"},
      {"train", "good.binary", "WHAT.binary", "--out", "x.h5"},
      {"rig", "check", "WHAT"},
      {"plan", "--directions", "WHAT", "--rig", "rig.toml", "--out", "plan.csv"},
      {"plan", "--samples", "4", "--basis", "WHAT", "--out", "plan.csv"},
      {"sample", "builtin:slate", "--directions", "WHAT", "--out", "x.csv"},
      {"reconstruct", "samples.csv", "--basis", "WHAT", "--out", "x.binary"},
      {"measure", "WHAT", "--plan", "list.csv", "--material", "builtin:slate", "--out", "session"},
      {"measure", "rig.toml", "--plan", "WHAT", "--material", "builtin:slate", "--out", "session"},
      {"measure", "rig.toml", "--plan", "list.csv", "--material", "builtin:slate", "--out",
       "session", "--calibration", "WHAT"}};
  for (const auto& [what, found] :
       {std::pair("pipe", "found a pipe"), std::pair("/dev/zero", "found a device"),
        std::pair("empty", "found a folder")}) {
    std::filesystem::remove(folder / "WHAT.binary");
    std::filesystem::create_symlink(folder / what, folder / "WHAT.binary");
    for (std::vector<std::string> arguments : commands) {
      for (std::string& argument : arguments) {
        if (argument == "WHAT") argument = what;
      }
      if (arguments[0] == "train" && std::string(what) == "empty") continue;  // may be a folder
      refused(arguments, {found});
    }
  }
  refused({"rig", "check", "calibrated.toml"}, {"pipe: cannot read: found a pipe"});
  refused({"reconstruct", "pipe", "--basis", "basis.h5", "--out", "x.binary"}, {"pipe: "});
}

std::string repeated(const std::string& text, int times) {
  std::string all;
  for (int i = 0; i < times; ++i) all += text;
  return all;
}

TEST_F(HostileInput, TomlIsBoundedBeforeItIsParsed) {
  constexpr int kMany = 100000;
  const auto refuse = [&](const std::string& text, const std::string& line,
                          const std::string& why) {
    folder.write("deep.toml", text);
    refused({"rig", "check", "deep.toml"}, {"deep.toml:" + line + " TOML: found " + why});
  };
  const std::string parts = "a key of more than 16 parts";
  const std::string depth = "brackets more than 16 deep";
  refuse("\n" + repeated("a.", kMany) + "a = 1\n", "2", parts);
  refuse("x = '''\n# \"\n'''\n[" + repeated("a.", kMany) + "a]\n", "4", parts);
  refuse("\"#\"." + repeated("'#'.", kMany) + "a = 1\n", "1", parts);
  refuse("x = \"\"\"\\\"\"\"\"\"\n" + repeated("a . ", kMany) + "a = 1\n", "2", parts);
  refuse("x = { y = 1, " + repeated("a.", kMany) + "a = 1 }\n", "1", parts);
  refuse("x = " + repeated("[", kMany), "1", depth);
  refuse("x = " + repeated("{a = ", kMany), "1", depth);
  refuse("x = " + repeated("[\n", kMany), "17", depth);
  folder.write("long.toml", repeated("# \n", 400000));
  refused({"rig", "check", "long.toml"}, {"long.toml", "1048576"});
}

TEST_F(HostileInput, DotsAndBracketsInStringsAndCommentsAreNotCounted) {
  const std::string dots(200, '.');
  const std::string brackets(200, '[');
  folder.write("plain.toml", "# " + dots + brackets + "\n[rig] # " + brackets +
                                 "\nname = \"it's \\\"" + dots + brackets +
                                 "\" # '\n[white]\nid = '" + brackets +
                                 "\"'\npatch_mm = [\n1.5, # [\n 2.5]\n");
  EXPECT_THAT(run({"rig", "check", "plain.toml"}).out, HasSubstr("it's \"" + dots));
}

TEST_F(HostileInput, ANameTooLongIsBadInput) {
  const std::string name(5000, 'a');
  refused(
      {"measure", "rig.toml", "--plan", name, "--material", "builtin:slate", "--out", "session"},
      {name + ": File name too long"});
}

TEST_F(HostileInput, ALimitOnTheSizeOfFilesIsAnOrdinaryWriteError) {
  constexpr std::uint64_t kLimit = 4096;
  const std::vector<std::string> too_large{"File too large"};
  refused({"materials", "make", "made", "--only", "slate"}, too_large, kLimit);
  refused({"render", "builtin:slate", "--out", "x.png"}, too_large, kLimit);
  refused({"train", "builtin:slate", "builtin:gold-satin", "builtin:red-pmma", "--out", "x.h5"},
          {"x.h5: cannot write: File too large"}, kLimit);
  run({"train", "builtin:slate", "builtin:gold-satin", "builtin:red-pmma", "--out", "basis.h5"});
  run({"sample", "builtin:slate", "--directions", "list.csv", "--out", "samples.csv"});
  refused({"reconstruct", "samples.csv", "--basis", "basis.h5", "--out", "x.binary"}, too_large,
          kLimit);
  // Room for the result, but not for its bands.
  refused({"reconstruct", "samples.csv", "--basis", "basis.h5", "--out", "x.binary"}, too_large,
          std::uint64_t{40} << 20U);
  EXPECT_FALSE(std::filesystem::exists(folder / "x.binary"));
  // A session keeps what it has: it ends with an error instead of a signal.
  const Ended session = run_gonio({"measure", "rig.toml", "--plan", "list.csv", "--material",
                                   "builtin:slate", "--out", "session"},
                                  folder.path(), 65536);
  EXPECT_EQ(session.exit_code, 4) << session.error;
  EXPECT_THAT(session.error, HasSubstr("cannot write"));
  EXPECT_THAT(run_gonio({"status", "session"}, folder.path()).out, HasSubstr("interrupted"));
}

TEST_F(HostileInput, AResultThatCannotBeWrittenIsAnError) {
  const std::string command = std::string("exec \"") + GONIO_PROGRAM + "\" materials list --json";
  const auto exit_code = [&](const std::string& to) {
    const int status = std::system(("(" + command + ") " + to + " 2>/dev/null").c_str());
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  };
  EXPECT_EQ(exit_code("> /dev/full"), 2);
  EXPECT_EQ(exit_code(">&-"), 2);
  EXPECT_EQ(exit_code("> /dev/null"), 0);
}

TEST_F(HostileInput, OutputsHaveTheNamesOfTheirFormat) {
  folder.write("samples.csv", "theta_h_deg,theta_d_deg,phi_d_deg,r,g,b\n3,12,28,1,1,1\n");
  for (const std::string out : {"found.csv", "found", "-"}) {
    refused({"reconstruct", "samples.csv", "--basis", "basis.h5", "--out", out}, {"--out", out});
  }
  refused({"sample", "builtin:slate", "--directions", "nielsen-10", "--out", "-"}, {"--out", "-"});
}

}  // namespace
}  // namespace gonio
