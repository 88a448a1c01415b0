// `gonio calibrate` and `gonio align` where a person, a signal or an edited file gets in the way.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <csignal>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>

#include "gonio/files/sha256.h"
#include "gonio/files/text_file.h"
#include "workflow.h"

namespace gonio {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

constexpr std::int64_t kIn2033_s = 2'000'000'000;
/// Far more than it takes, for machines that are busy.
constexpr std::chrono::minutes kAtOnce{1};
const std::string kPrompt = "Mount the flat mirror, then press Enter";

class CalibrateFaults : public Workflow {
 protected:
  /// A hidden world on few pixels: enough for the steps that look at no target's shape.
  void SetUp() override {
    Workflow::SetUp();
    folder.write("rig.toml", kSmallRig + "[simulation]\nhidden = true\n");
  }

  void take(const std::vector<std::string>& steps) {
    std::vector<std::string> arguments{"calibrate", "rig.toml", "--out", "cal", "--yes", "--only"};
    arguments.insert(arguments.end(), steps.begin(), steps.end());
    run(arguments);
  }

  /// Standard input open and nobody there, until it asks for the mirror.
  std::unique_ptr<GonioProcess> waiting(std::vector<std::string> more = {}) {
    std::vector<std::string> arguments{"calibrate", "rig.toml", "--out", "cal"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    auto process =
        std::make_unique<GonioProcess>(arguments, folder.path(), 0, GONIO_PROGRAM, Input::open);
    EXPECT_TRUE(process->wait_for(kPrompt)) << process->said();
    return process;
  }

  std::map<std::string, std::string> states() {
    std::map<std::string, std::string> states;
    const Ended list = run({"calibrate", "rig.toml", "--out", "cal", "--list", "--json"});
    const auto document = nlohmann::json::parse(list.out);
    for (const auto& step : document["steps"]) {
      states[step["step"]] = step["state"];
    }
    return states;
  }

  nlohmann::json archive() {
    return nlohmann::json::parse(
        files::read_text_file(folder.path() / "cal" / "calibration.json", kEnough));
  }
  void write_archive(const nlohmann::json& document) {
    folder.write("cal/calibration.json", document.dump());
  }

  /// Constants of few pixels that could be a calibration's.
  nlohmann::json constants() {
    auto constants = nlohmann::json::parse(run({"rig", "example", "--type", "calibration"}).out);
    const nlohmann::json camera = {{"width_px", 80}, {"height_px", 64}, {"fx_px", 345.0},
                                   {"fy_px", 345.0}, {"cx_px", 39.5},   {"cy_px", 31.5}};
    constants["camera"].update(camera);
    constants["archive"] = "calibration.json";
    return constants;
  }

  /// Every file below cal with its contents and when it was written.
  std::map<std::string, std::string> snapshot() const {
    std::map<std::string, std::string> files;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(folder.path() / "cal")) {
      std::string what = std::to_string(entry.last_write_time().time_since_epoch().count());
      if (entry.is_regular_file()) what += files::sha256_of_file(entry.path());
      files[entry.path().string()] = what;
    }
    return files;
  }

  std::string refused_list() {
    return run({"calibrate", "rig.toml", "--out", "cal", "--list"}, 2).error;
  }
};

TEST_F(CalibrateFaults, AKilledRedoLeavesWhatWasToBeRedoneStale) {
  take({"darks", "warm_up"});
  const auto process = waiting({"--redo"});
  process->send(SIGKILL);
  process->wait();
  EXPECT_EQ(states()["darks"], "stale");
  EXPECT_EQ(states()["warm_up"], "stale");
  EXPECT_THAT(files::read_text_file(folder.path() / "cal" / "report.html", kEnough),
              HasSubstr("2 stale"));
  take({"darks"});
  EXPECT_EQ(states()["darks"], "valid");
  EXPECT_EQ(states()["warm_up"], "stale");
}

TEST_F(CalibrateFaults, ARedoOfOneStepLeavesTheOthers) {
  take({"darks", "warm_up"});
  const auto process = waiting({"--redo", "--only", "homing", "warm_up"});
  process->send(SIGTERM);
  ASSERT_TRUE(process->ends_within(kAtOnce));
  EXPECT_EQ(process->wait().exit_code, 1);
  EXPECT_EQ(states()["darks"], "valid");
  EXPECT_EQ(states()["warm_up"], "stale");
}

TEST_F(CalibrateFaults, ASignalEndsTheWaitingForATargetAtOnce) {
  for (const int signal : {SIGINT, SIGTERM}) {
    const auto process = waiting();
    process->send(signal);
    ASSERT_TRUE(process->ends_within(kAtOnce)) << signal;
    const Ended ended = process->wait();
    EXPECT_EQ(ended.exit_code, 1);
    EXPECT_THAT(ended.error, HasSubstr("interrupted"));
    EXPECT_FALSE(std::filesystem::exists(folder.path() / "cal" / "calibration.json"));
  }
}

TEST_F(CalibrateFaults, ASessionThatWaitsForAPersonTakesALineEachAndHearsThePause) {
  folder.write("manual.toml", kSmallRig + "[white]\nplacement = \"manual\"\n");
  const auto measuring = [&](const char* out) {
    return std::make_unique<GonioProcess>(
        std::vector<std::string>{"measure", "manual.toml", "--plan", "list.csv", "--out", out,
                                 "--material", "builtin:grey-abs"},
        folder.path(), 0, GONIO_PROGRAM, Input::open);
  };
  // All answers are there before the first is read.
  const auto answered = measuring("whole");
  answered->answer("\n\n\n\n");
  ASSERT_TRUE(answered->ends_within(kAtOnce));
  EXPECT_EQ(answered->wait().exit_code, 0);
  const auto paused = measuring("paused");
  ASSERT_TRUE(paused->wait_for("Mount the white"));
  paused->send(SIGINT);
  ASSERT_TRUE(paused->ends_within(kAtOnce));
  const Ended ended = paused->wait();
  EXPECT_EQ(ended.exit_code, 4);
  EXPECT_THAT(ended.error, AllOf(HasSubstr("paused after 0 of 5 directions"),
                                 HasSubstr("gonio resume paused goes on with it")));
}

TEST_F(CalibrateFaults, AnInputThatHasEndedSaysSo) {
  const Ended ended = run({"calibrate", "rig.toml", "--out", "cal"}, 3);
  EXPECT_THAT(ended.error, HasSubstr("found the end of standard input, expected Enter once the "
                                     "flat mirror is mounted"));
}

TEST_F(CalibrateFaults, ListingBesideARunningCalibrationWritesNothing) {
  take({"darks"});
  const auto process = waiting();
  // As the other one leaves it between two writes.
  folder.write("cal/instrument.json", constants().dump());
  const auto before = snapshot();
  EXPECT_EQ(states()["darks"], "valid");
  EXPECT_EQ(snapshot(), before);
}

TEST_F(CalibrateFaults, WhatIsOfATimeToComeHasNoAge) {
  take({"darks"});
  nlohmann::json document = archive();
  const std::int64_t valid_s = document["results"][0]["valid_until_utc_s"].get<std::int64_t>() -
                               document["results"][0]["finished_utc_s"].get<std::int64_t>();
  document["results"][0]["finished_utc_s"] = kIn2033_s;
  document["results"][0]["valid_until_utc_s"] = kIn2033_s + valid_s;
  write_archive(document);
  const std::string said = "darks finished: found 2033-05-18 03:33 UTC, which is to come";
  EXPECT_THAT(refused_list(), HasSubstr(said));
  folder.write("cal/instrument.json", constants().dump());
  EXPECT_THAT(
      run({"align", "rig.toml", "--calibration", "cal", "--out", "a.json", "--seat-sigma", "0.1"},
          2)
          .error,
      HasSubstr(said));
  const std::vector<std::string> measure{"measure",     "rig.toml", "--plan",     "list.csv",
                                         "--out",       "session",  "--material", "builtin:slate",
                                         "--alignment", "a.json"};
  run({"align", "rig.toml", "--out", "a.json", "--seat-sigma", "0.1"});
  auto alignment = nlohmann::json::parse(files::read_text_file(folder.path() / "a.json", kEnough));
  alignment["found_utc_s"] = kIn2033_s;
  folder.write("a.json", alignment.dump());
  EXPECT_THAT(run(measure, 2).error,
              HasSubstr("alignment: found_utc_s: found 2033-05-18 03:33 UTC, which is to come"));
  EXPECT_FALSE(std::filesystem::exists(folder.path() / "session"));
}

TEST_F(CalibrateFaults, ASessionIsToldOfTargetsThatAreOthers) {
  take({"darks"});
  nlohmann::json document = archive();
  nlohmann::json plane = document["results"][0];
  plane["step"] = "sample_plane";
  plane["inputs"] = {{"stage_axes", std::string(64, 'a')}};
  plane["told"] = {{"sample_raised_mm", "5"}, {"u_sample_raised_mm", "0.05"}};
  document["results"].push_back(plane);
  write_archive(document);
  folder.write("cal/instrument.json", constants().dump());
  const auto check = [&](const std::string& targets) {
    folder.write("used.toml", "[rig]\ncalibration = \"cal\"\n" + kSmallRig +
                                  "[simulation]\nhidden = true\n[targets]\n" + targets);
    return run({"rig", "check", "used.toml"}).out;
  };
  const std::string said = "sample_plane was made with other targets";
  EXPECT_THAT(check("sample_raised_mm = 5\n"), Not(HasSubstr(said)));
  EXPECT_THAT(check("sample_raised_mm = 6\n"),
              HasSubstr(said + ": sample_raised_mm was 5, now it is 6;"));
}

TEST_F(CalibrateFaults, ConstantsAwayFromTheirArchiveAreRefused) {
  take({"darks"});
  folder.write("cal/instrument.json", constants().dump());
  folder.write("copy.json", constants().dump());
  std::filesystem::create_symlink("cal/instrument.json", folder.path() / "link.json");
  const auto align = [&](const std::string& calibration) {
    return run({"align", "rig.toml", "--calibration", calibration, "--out", "a.json",
                "--seat-sigma", "0.1"},
               2)
        .error;
  };
  EXPECT_THAT(align("copy.json"), HasSubstr("away from its calibration.json"));
  EXPECT_THAT(align("link.json"), HasSubstr("homing is missing"));
  EXPECT_FALSE(std::filesystem::exists(folder.path() / "a.json"));
}

TEST_F(CalibrateFaults, WhatCannotBeWrittenIsSaidBeforeAnythingMoves) {
  for (const char* name : {"report.html", "calibration.json", "instrument.json"}) {
    std::filesystem::create_directories(folder.path() / "cal" / name);
    EXPECT_THAT(run({"calibrate", "rig.toml", "--out", "cal", "--yes", "--only", "darks"}, 2).error,
                HasSubstr(std::string(name) + ": cannot replace: it is not a regular file"));
    std::filesystem::remove(folder.path() / "cal" / name);
  }
  std::filesystem::create_directories(folder.path() / "taken");
  EXPECT_THAT(
      run({"align", "rig.toml", "--out", "taken", "--force", "--material", "builtin:gold-satin"}, 2)
          .error,
      AllOf(HasSubstr("taken: cannot replace: it is not a regular file"),
            Not(HasSubstr("aligning"))));
  std::filesystem::remove_all(folder.path() / "cal" / "raw");
  std::filesystem::create_directory_symlink(folder.path() / "taken", folder.path() / "cal" / "raw");
  EXPECT_THAT(run({"calibrate", "rig.toml", "--out", "cal", "--yes", "--only", "darks"}, 2).error,
              HasSubstr("raw: found a link"));
  EXPECT_TRUE(std::filesystem::is_empty(folder.path() / "taken"));
}

TEST_F(CalibrateFaults, AStepThatLacksItsInputsIsRefusedBeforeADeviceIsOpened) {
  // No device of this rig is there: opening them would end with 3.
  EXPECT_THAT(run({"calibrate", GONIO_RIGS "/lab_example.toml", "--out", "cal", "--only", "darks",
                   "stage_axes"},
                  2)
                  .error,
              HasSubstr("stage_axes needs intrinsics, which is missing: take that step first"));
}

TEST_F(CalibrateFaults, ASeatThatIsKnownTooWellIsNone) {
  EXPECT_THAT(run({"align", "rig.toml", "--out", "a.json", "--seat-sigma", "1e-9"}, 2).error,
              HasSubstr("--seat-sigma: covariance: found a sigma of 1e-09 deg, expected 1e-05"));
}

TEST_F(CalibrateFaults, AMatteBlackSampleIsAlignedByItsSeat) {
  // What shows no highlight once sent the search up to the end of the tilt.
  for (const char* material : {"builtin:blackboard-paint", "builtin:red-felt"}) {
    const Ended ended = run({"align", "rig.toml", "--out", "a.json", "--material", material}, 5);
    EXPECT_THAT(ended.error, AllOf(HasSubstr("found no highlight"), HasSubstr("--seat-sigma DEG")))
        << material;
  }
  EXPECT_FALSE(std::filesystem::exists(folder.path() / "a.json"));
}

TEST_F(CalibrateFaults, AnArchiveNamesItsDevicesAndNumbersThatCanBe) {
  take({"darks"});
  const nlohmann::json good = archive();
  nlohmann::json nameless = good;
  for (auto& serial : nameless["serials"]) serial = "";
  write_archive(nameless);
  EXPECT_THAT(refused_list(), HasSubstr("cal/calibration.json: contents: serials: found \"\""));

  nlohmann::json edited = good;
  auto& raw = edited["results"][0]["raw_data"][0];
  const std::filesystem::path path = folder.path() / "cal" / raw["file"].get<std::string>();
  auto seen = nlohmann::json::parse(files::read_text_file(path, kEnough));
  seen["darks"]["black_level_dn"]["value"] = 1e150;
  const std::string sha256 = files::sha256_of_bytes(std::string_view(seen.dump()));
  const std::string name = "raw/darks-" + sha256.substr(0, 12) + ".json";
  folder.write("cal/" + name, seen.dump());
  raw["file"] = name;
  raw["sha256"] = sha256;
  write_archive(edited);
  EXPECT_THAT(refused_list(), HasSubstr("darks.black_level_dn.value: found 1e+150, expected"));
}

}  // namespace
}  // namespace gonio
