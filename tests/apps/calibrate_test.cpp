// `gonio calibrate` and what sessions make of its folder.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <nlohmann/json.hpp>
#include <regex>

#include "gonio/acquisition/session_archive.h"
#include "gonio/calibration/board/board_spec.h"
#include "gonio/files/process_lock.h"
#include "gonio/files/text_file.h"
#include "workflow.h"

namespace gonio {
namespace {

using testing::HasSubstr;

class Calibrate : public Workflow {
 protected:
  /// A hidden world on few pixels: enough for the steps that look at no target's shape.
  void SetUp() override {
    Workflow::SetUp();
    folder.write("rig.toml", kSmallRig + "[simulation]\nhidden = true\n");
  }
};

TEST_F(Calibrate, TakesStepsAloneAndGoesOnFromItsFolder) {
  run({"calibrate", "rig.toml", "--out", "cal", "--yes", "--only", "darks", "warm_up",
       "--temperature", "-2.5"});
  const Ended list = run({"calibrate", "rig.toml", "--out", "cal", "--list", "--json"});
  const auto document = nlohmann::json::parse(list.out);
  EXPECT_FALSE(document["complete"].get<bool>());
  for (const auto& step : document["steps"]) {
    const bool taken = step["step"] == "darks" || step["step"] == "warm_up";
    EXPECT_EQ(step["state"], taken ? "valid" : "missing") << step["step"];
  }
  EXPECT_THAT(files::read_text_file(folder.path() / "cal" / "report.html", kEnough),
              AllOf(HasSubstr("darks"), HasSubstr("-2.5 &deg;C")));
}

TEST_F(Calibrate, WorksInAFolderAlone) {
  std::filesystem::create_directories(folder.path() / "cal");
  const files::ProcessLock another(folder.path() / "cal" / "calibration.lock");
  const std::vector<std::string> darks{"calibrate", "rig.toml", "--out", "cal",
                                       "--yes",     "--only",   "darks"};
  EXPECT_THAT(run(darks, 2).error, HasSubstr("is calibrating in this folder"));
  run({"calibrate", "rig.toml", "--out", "cal", "--list"});
  EXPECT_FALSE(std::filesystem::exists(folder.path() / "cal" / "calibration.json"));
}

TEST_F(Calibrate, TellsAFolderThatTakesNothingAndOneThatIsNone) {
  folder.write("file", "");
  std::filesystem::create_directories(folder.path() / "cal");
  folder.write("cal/raw", "");
  EXPECT_THAT(run({"calibrate", "rig.toml", "--out", "cal", "--yes", "--only", "darks"}, 2).error,
              HasSubstr("cal/raw: cannot make"));
  EXPECT_THAT(run({"calibrate", "rig.toml", "--out", "file", "--yes"}, 2).error,
              HasSubstr("file is no folder"));
  EXPECT_THAT(run({"calibrate", "rig.toml", "--out", "file", "--list"}, 2).error,
              HasSubstr("file is no folder"));
  EXPECT_THAT(run({"calibrate", "rig.toml", "--out", "", "--yes"}, 2).error,
              HasSubstr("names no folder"));
}

TEST_F(Calibrate, NobodyElseWritesItsFiles) {
  const std::vector<std::string> own{"cal/calibration.json", "cal/instrument.json",
                                     "cal/raw/darks-0123456789ab.json"};
  std::filesystem::create_directories(folder.path() / "cal" / "raw");
  for (const std::string& file : own) folder.write(file, "kept");
  for (const std::string& file : own) {
    EXPECT_THAT(
        run({"align", "rig.toml", "--seat-sigma", "0.1", "--out", file, "--force"}, 2).error,
        HasSubstr("is the calibration's in "))
        << file;
    EXPECT_EQ(files::read_text_file(folder.path() / file, kEnough), "kept");
  }
  run({"align", "rig.toml", "--seat-sigma", "0.1", "--out", "cal/alignment.json"});
}

TEST_F(Calibrate, SaysWhatIsWrongWithTheCommand) {
  EXPECT_THAT(run({"calibrate", "rig.toml", "--out", "cal", "--only", "drks"}, 2).error,
              HasSubstr("did you mean \"darks\"?"));
  EXPECT_THAT(
      run({"calibrate", "rig.toml", "--out", "cal", "--yes", "--only", "stage_axes"}, 2).error,
      HasSubstr("take that step first"));
  EXPECT_FALSE(std::filesystem::exists(folder.path() / "cal" / "calibration.json"));
}

TEST_F(Calibrate, DrawsTheBoardAtItsTrueSize) {
  run({"board", "--out", "board.svg"});
  const std::string svg = files::read_text_file(folder.path() / "board.svg", kEnough);
  EXPECT_THAT(svg, HasSubstr("width=\"130mm\" height=\"118mm\""));  // 11 x 9 squares of 10 mm
  double black_mm2 = 0.0;
  const std::regex bar("h([0-9.]+)v([0-9.]+)h-");
  for (std::sregex_iterator it(svg.begin(), svg.end(), bar), end; it != end; ++it) {
    black_mm2 += std::stod((*it)[1]) * std::stod((*it)[2]);
  }
  const calibration::board::BoardSpec spec;
  const std::vector<bool> white = calibration::board::board_cells(spec).white;
  const auto black = static_cast<double>(std::count(white.begin(), white.end(), false));
  EXPECT_NEAR(black_mm2, black * spec.cell_mm() * spec.cell_mm(), 1e-6);
}

TEST_F(Calibrate, SaysWhatIsWrongWithAChart) {
  const auto refused = [&](const std::string& chart) {
    folder.write("chart.csv", chart);
    return run({"calibrate", GONIO_RIGS "/lab_example.toml", "--out", "cal", "--chart",
                "chart.csv"},
               2)
        .error;
  };
  EXPECT_THAT(refused("row,column,red,green\n0,0,1,1\n"), HasSubstr("found no column blue"));
  EXPECT_THAT(refused("row,column,red,green,blue\n0,0,1,1,1\n0,0,1,1,1\n"),
              HasSubstr("line 3: found the patch of row 0, column 0 again"));
  EXPECT_THAT(refused("row,column,red,green,blue\n0,0,1,1,1\n1,1,1,1,1\n"),
              HasSubstr("found 2 patches, expected all of 2 x 2"));
  EXPECT_THAT(refused("row,column,red,green,blue\n0.5,0,1,1,1\n"), HasSubstr("whole number"));
  EXPECT_THAT(run({"calibrate", "rig.toml", "--out", "cal", "--square-mm", "10.1"}, 2).error,
              HasSubstr("has targets of its own"));
  EXPECT_FALSE(std::filesystem::exists(folder.path() / "cal"));
}

TEST_F(Calibrate, NobodyMountingATargetEndsIt) {
  // Standard input is at its end.
  EXPECT_NE(run_gonio({"calibrate", "rig.toml", "--out", "cal", "--only", "warm_up"}, folder.path())
                .exit_code,
            0);
  EXPECT_FALSE(std::filesystem::exists(folder.path() / "cal" / "calibration.json"));
}

TEST_F(Calibrate, ASessionRefusesACalibrationThatIsNotThroughYet) {
  run({"calibrate", "rig.toml", "--out", "cal", "--yes", "--only", "darks"});
  const std::vector<std::string> measure{
      "measure", "rig.toml", "--plan",  "list.csv",   "--calibration",
      "cal",     "--out",    "session", "--material", "builtin:grey-abs"};
  const Ended refused = run(measure, 2);
  EXPECT_THAT(refused.error, HasSubstr("a calibration whose steps have all passed"));
  EXPECT_FALSE(std::filesystem::exists(folder.path() / "session"));
}

TEST_F(Calibrate, RigCheckAndStatusSayWhichCalibrationIsUsedAndUntilWhen) {
  run({"calibrate", "rig.toml", "--out", "cal", "--yes", "--only", "darks", "warm_up"});
  auto constants = nlohmann::json::parse(run({"rig", "example", "--type", "calibration"}).out);
  const nlohmann::json camera = {{"width_px", 80}, {"height_px", 64}, {"fx_px", 345.0},
                                 {"fy_px", 345.0}, {"cx_px", 39.5},   {"cy_px", 31.5}};
  constants["camera"].update(camera);
  folder.write("cal/instrument.json", constants.dump());
  // The darks are of 2023.
  auto archive = nlohmann::json::parse(
      files::read_text_file(folder.path() / "cal" / "calibration.json", kEnough));
  for (auto& result : archive["results"]) {
    if (result["step"] != "darks") continue;
    result["finished_utc_s"] = 1'699'999'000;
    result["valid_until_utc_s"] = 1'700'000'000;
  }
  folder.write("cal/calibration.json", archive.dump());
  folder.write("used.toml", "[rig]\ncalibration = \"cal\"\n" + kSmallRig);
  const Ended nominal = run({"rig", "check", "rig.toml"});
  EXPECT_THAT(nominal.out, HasSubstr("without age"));
  const Ended check = run({"rig", "check", "used.toml"});
  const std::string said = ", valid until 2023-11-14T22:13:20Z, expired: darks; missing: homing, ";
  EXPECT_THAT(check.out, HasSubstr("calibration     "));
  EXPECT_THAT(check.out, HasSubstr("cal" + said));
  EXPECT_THAT(check.out, HasSubstr("against it    darks is expired since 2023-11-14 22:13 UTC"));
  const auto document = nlohmann::json::parse(run({"rig", "check", "used.toml", "--json"}).out);
  EXPECT_THAT(document["calibration_text"].get<std::string>(), HasSubstr(said));
  EXPECT_GE(document["calibration_reasons"].size(), 17U);

  run({"measure", "used.toml", "--plan", "list.csv", "--out", "session", "--material",
       "builtin:grey-abs", "--accept-calibration", "--accept-unaligned"});
  const Ended status = run({"status", "session"});
  EXPECT_THAT(status.out, HasSubstr("calibration      "));
  EXPECT_THAT(status.out, HasSubstr("cal" + said));
  EXPECT_THAT(status.out, HasSubstr("calibration_accepted_despite"));
  EXPECT_THAT(status.out, testing::Not(HasSubstr("calibration_open_steps")));
  train();
  run({"report", "session", "--basis", "basis.h5", "--out", "report.html"});
  EXPECT_THAT(files::read_text_file(folder.path() / "report.html", kEnough),
              HasSubstr("cal" + said));
}

TEST_F(Calibrate, ASessionOnACalibrationWantsAnAlignedSample) {
  run({"calibrate", "rig.toml", "--out", "cal", "--yes", "--only", "darks"});
  // Its constants, as if the other steps had passed too.
  run({"measure", "rig.toml", "--plan", "list.csv", "--material", "builtin:grey-abs", "--out",
       "before"});
  const acquisition::SessionReader session(folder.path() / "before");
  folder.write("cal/instrument.json", session.configuration().at("calibration.json"));
  std::vector<std::string> measure{
      "measure", "rig.toml", "--plan",     "list.csv",         "--calibration",       "cal",
      "--out",   "session",  "--material", "builtin:grey-abs", "--accept-calibration"};
  EXPECT_THAT(run(measure, 2).error, HasSubstr("nobody has looked how the sample lies"));
  EXPECT_FALSE(std::filesystem::exists(folder.path() / "session"));
  measure.emplace_back("--accept-unaligned");
  run(measure);
  const auto status = nlohmann::json::parse(run({"status", "session", "--json"}).out);
  EXPECT_EQ(status["metadata"]["alignment"], "none, accepted");
}

TEST_F(Calibrate, APlansJointsAreWorkedOutAgainForASampleThatLeans) {
  train();
  run({"plan", "--basis", "basis.h5", "--samples", "3", "--rig", "rig.toml", "--out", "plan.csv"});
  EXPECT_THAT(files::read_text_file(folder.path() / "plan.csv", kEnough), HasSubstr("azimuth"));
  run({"align", "rig.toml", "--out", "a.json", "--seat-sigma", "0.1"});
  auto leaning = nlohmann::json::parse(files::read_text_file(folder.path() / "a.json", kEnough));
  leaning["tilt_rad"] = {0.005, 0.0};
  folder.write("a.json", leaning.dump());
  run({"measure", "rig.toml", "--plan", "plan.csv", "--alignment", "a.json", "--material",
       "builtin:grey-abs", "--dry-run"});
}

TEST_F(Calibrate, AMatteSampleIsAlignedByItsSeat) {
  run({"align", "rig.toml", "--out", "a.json", "--seat-sigma", "0.1", "--sample-id", "A17"});
  const auto document =
      nlohmann::json::parse(files::read_text_file(folder.path() / "a.json", kEnough));
  EXPECT_EQ(document["method"], "seat");
  EXPECT_EQ(document["sample"], "A17");
  run({"measure", "rig.toml", "--plan", "list.csv", "--alignment", "a.json", "--material",
       "builtin:grey-abs", "--dry-run"});
  // Constants that are others than those it was aligned with.
  folder.write("rig.toml",
               kSmallRig + "[white]\nu_relative = 0.01\n[simulation]\nhidden = false\n");
  EXPECT_THAT(run({"measure", "rig.toml", "--plan", "list.csv", "--alignment", "a.json",
                   "--material", "builtin:grey-abs", "--dry-run"},
                  2)
                  .error,
              HasSubstr("was made with other constants"));
  run({"measure", "rig.toml", "--plan", "list.csv", "--alignment", "a.json", "--material",
       "builtin:grey-abs", "--dry-run", "--accept-calibration"});
}

TEST_F(Calibrate, ASeatIsGivenWithItsSigmaOrNotAtAll) {
  const auto refused = [&](const std::vector<std::string>& more) {
    std::vector<std::string> align{"align", "rig.toml", "--out", "a.json"};
    align.insert(align.end(), more.begin(), more.end());
    return run(align, 2).error;
  };
  EXPECT_THAT(refused({"--seat-sigma", "0"}), HasSubstr("--seat-sigma"));
  EXPECT_THAT(refused({"--seat-sigma", "0.1", "--material", "builtin:gold-satin"}),
              HasSubstr("--seat-sigma: nothing is looked at"));
  EXPECT_THAT(refused({"--seat-sigma", "0.1", "--seed", "2"}),
              HasSubstr("--seat-sigma: nothing is looked at"));
  EXPECT_FALSE(std::filesystem::exists(folder.path() / "a.json"));
}

TEST_F(Calibrate, AnAlignmentOfAnotherSampleOrOfLongAgoIsRefused) {
  run({"align", "rig.toml", "--out", "a.json", "--seat-sigma", "0.1", "--sample-id", "A17"});
  std::vector<std::string> measure{"measure",    "rig.toml",         "--plan",      "list.csv",
                                   "--out",      "session",          "--alignment", "a.json",
                                   "--material", "builtin:grey-abs", "--sample-id"};
  const auto of = [&](const std::string& sample, std::vector<std::string> more = {}) {
    std::vector<std::string> arguments = measure;
    arguments.push_back(sample);
    arguments.insert(arguments.end(), more.begin(), more.end());
    return arguments;
  };
  EXPECT_THAT(run(of("A18"), 2).error, HasSubstr("found one of sample \"A17\", expected \"A18\""));
  run(of("A17", {"--dry-run"}));
  auto document = nlohmann::json::parse(files::read_text_file(folder.path() / "a.json", kEnough));
  document["found_utc_s"] = 1'700'000'000;
  folder.write("a.json", document.dump());
  EXPECT_THAT(run(of("A17"), 2).error, HasSubstr("is of 2023-11-14 22:13 UTC"));
  EXPECT_FALSE(std::filesystem::exists(folder.path() / "session"));
  run(of("A18", {"--accept-unaligned"}));
  const auto status = nlohmann::json::parse(run({"status", "session", "--json"}).out);
  EXPECT_THAT(status["metadata"]["alignment_accepted_despite"].get<std::string>(),
              testing::AllOf(HasSubstr("A17"), HasSubstr("2023-11-14")));
  EXPECT_EQ(status["metadata"]["alignment_found_utc"], "2023-11-14T22:13:20Z");
}

TEST_F(Calibrate, ASampleIsAlignedOnACalibrationThatASessionWouldTake) {
  run({"calibrate", "rig.toml", "--out", "cal", "--yes", "--only", "darks"});
  run({"measure", "rig.toml", "--plan", "list.csv", "--material", "builtin:grey-abs", "--out",
       "before"});
  const acquisition::SessionReader session(folder.path() / "before");
  folder.write("cal/instrument.json", session.configuration().at("calibration.json"));
  for (const char* calibration : {"cal", "cal/instrument.json"}) {
    std::vector<std::string> align{"align", "rig.toml", "--calibration", calibration,
                                   "--out", "a.json",   "--seat-sigma",  "0.1"};
    EXPECT_THAT(run(align, 2).error, HasSubstr("homing is missing")) << calibration;
    EXPECT_FALSE(std::filesystem::exists(folder.path() / "a.json"));
  }
  run({"align", "rig.toml", "--calibration", "cal", "--out", "a.json", "--seat-sigma", "0.1",
       "--accept-calibration"});
}

}  // namespace
}  // namespace gonio
