#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <set>

#include "workflow.h"

namespace gonio {
namespace {

using testing::HasSubstr;

/// A plan without its comments and header.
std::string rows_of(const std::string& csv) {
  const std::size_t header = csv.find("theta_h_deg");
  return csv.substr(csv.find('\n', header) + 1);
}

TEST_F(Workflow, ChoosesPosesForWhatTheRigsFramesShow) {
  train();
  const Ended chosen = run({"plan", "--basis", "basis.h5", "--samples", "3", "--rig", "rig.toml",
                            "--out", "plan.csv", "--explain"});
  // Spots of 2 mm half width, 2 mm clear of the edge of 25 mm: the outermost at 21 mm of 5 x 5.
  EXPECT_THAT(folder.read("plan.csv"), HasSubstr("patches of +-26.25 mm (5 x 5)"));
  EXPECT_THAT(chosen.out, HasSubstr("a sample of +-50"));
  const Ended assumed =
      run({"plan", "--basis", "basis.h5", "--samples", "3", "--out", "list2.csv"});
  EXPECT_THAT(assumed.error, HasSubstr("no rig: patches of +-25 mm"));
  run({"plan", "--basis", "basis.h5", "--samples", "3", "--patch", "0", "--out", "points.csv"});
  EXPECT_THAT(folder.read("points.csv"), HasSubstr("points"));
  EXPECT_NE(folder.read("points.csv").substr(folder.read("points.csv").find("phi_d_deg")),
            folder.read("list2.csv").substr(folder.read("list2.csv").find("phi_d_deg")));
}

TEST_F(Workflow, RefinesUpToFivePointsByMaterialsLeftOut) {
  train();
  const auto rows = [&](const std::string& count, const std::string& objective) {
    run({"plan", "--basis", "basis.h5", "--samples", count, "--patch", "0", "--objective",
         objective, "--out", "p.csv", "--force"});
    return rows_of(folder.read("p.csv"));
  };
  EXPECT_EQ(rows("5", "auto"), rows("5", "loo"));
  EXPECT_THAT(folder.read("p.csv"), HasSubstr("objective a, then loo"));
  EXPECT_NE(rows("5", "a"), rows("5", "loo"));
  EXPECT_EQ(rows("6", "auto"), rows("6", "a"));
  EXPECT_THAT(folder.read("p.csv"), HasSubstr("objective a,"));
}

TEST_F(Workflow, ReconstructsFromTwoPhotographsTakenFromNear) {
  train();
  const Ended chosen =
      run({"plan", "--basis", "basis.h5", "--near-field", "--shots", "2", "--out", "shots.csv"});
  EXPECT_THAT(chosen.out, HasSubstr("keeps 90 % of what an endless one shows"));
  run({"sample", "builtin:pink-polypropylene", "--directions", "shots.csv", "--near-field",
       "--noise", "0.05", "--out", "samples.csv"});
  run({"reconstruct", "samples.csv", "--basis", "basis.h5", "--method", "ridge", "--out",
       "found.binary"});
  const auto errors = nlohmann::json::parse(
      run({"compare", "builtin:pink-polypropylene", "found.binary", "--json"}).out);
  EXPECT_GT(errors["psnr_a_db"].get<double>(), 22.0);  // as above, a little less
}

TEST_F(Workflow, ExplainsDirectionsFromEverySearch) {
  train();
  const std::vector<std::vector<std::string>> searches = {
      {"--objective", "loo", "--weights", "image=1,uniform=1"},
      {"--objective", "d", "--noise", "0.05", "--time-price", "2"},
      {"--method", "xu"}};
  std::set<std::string> plans;  // their rows: the comments name the search
  for (const std::vector<std::string>& search : searches) {
    std::vector<std::string> arguments = {"plan",     "--basis", "basis.h5", "--samples",
                                          "4",        "--rig",   "rig.toml", "--out",
                                          "plan.csv", "--force", "--json",   "--explain"};
    arguments.insert(arguments.end(), search.begin(), search.end());
    const auto explained = nlohmann::json::parse(run(arguments).out);
    const auto& figures = explained["figures"];
    EXPECT_GT(figures["condition_number"], 1.0);
    EXPECT_GT(figures["xu_metric"], 0.0);
    EXPECT_GT(figures["bayes_a"], 0.0);
    EXPECT_LT(figures["bayes_d"], 0.0);
    EXPECT_GT(figures["expected_psnr_db"], 5.0);
    EXPECT_GT(figures["expected_psnr_standard_error_db"], 0.0);
    EXPECT_LE(figures["uncovered"]["share_of_error"], 1.0);
    EXPECT_EQ(figures["uncovered"]["theta_d_deg"].size(), 2U);
    EXPECT_EQ(explained["session"]["points"].size(), 4U);
    plans.insert(rows_of(folder.read("plan.csv")));
  }
  EXPECT_EQ(plans.size(), searches.size()) << "every search has its own answer";
}

TEST_F(Workflow, PlansPosesForTheNoiseItIsTold) {
  train();
  const auto plan = [&](const std::string& noise) {
    run({"plan", "--basis", "basis.h5", "--samples", "2", "--noise", noise, "--out", "plan.csv",
         "--force"});
    return rows_of(folder.read("plan.csv"));
  };
  EXPECT_NE(plan("0.001"), plan("1"));
}

TEST_F(Workflow, WeighsAndPlansShotsByWhatItIsTold) {
  train();
  const auto table = [&](const std::vector<std::string>& words) {
    std::vector<std::string> arguments{"plan",         "--basis",      "basis.h5",
                                       "--near-field", "--directions", "list.csv",
                                       "--out",        "shots.csv",    "--force"};
    arguments.insert(arguments.end(), words.begin(), words.end());
    return run(arguments).out;
  };
  const std::string plain = table({});
  EXPECT_NE(table({"--weights", "uniform"}), plain);
  EXPECT_NE(table({"--noise", "1"}), plain);
}

TEST_F(Workflow, NamesOneExpectedErrorOfPosesAndOfPoints) {
  train();
  for (const std::string patch : {"0", "auto"}) {
    const std::string out = run({"plan", "--basis", "basis.h5", "--directions", "list.csv",
                                 "--patch", patch, "--explain", "--force", "--out", "plan.csv"})
                                .out;
    const std::string words = "expected weighted log error";
    const std::size_t first = out.find(words);
    EXPECT_NE(first, std::string::npos);
    EXPECT_EQ(out.find(words, first + 1), std::string::npos) << out;
    EXPECT_THAT(out, HasSubstr("criteria of the point search (eta 0.3)"));
  }
}

/// Constants of the example rig with another name and the lamp arm's zero off by 0.02 deg.
std::string other_constants(const std::string& example) {
  auto constants = nlohmann::json::parse(example);
  constants["id"] = "bench of May";
  auto& offset = constants["rig"]["lamp_chain"]["links"][0]["offset_deg"];
  offset = offset.get<double>() + 0.02;
  return constants.dump();
}

TEST_F(Workflow, PlansAndMeasuresWithTheConstantsOfACalibrationFile) {
  folder.write("calibration.json",
               other_constants(run({"rig", "example", "--type", "calibration"}).out));
  folder.write("calibrated.toml", "[rig]\ncalibration = \"calibration.json\"\n");
  folder.write("nominal.toml", "[rig]\n");
  EXPECT_THAT(run({"rig", "check", "calibrated.toml"}).out, HasSubstr("bench of May"));
  const auto plan = [&](const std::string& out, std::vector<std::string> rig) {
    std::vector<std::string> arguments{"plan", "--directions", "nielsen-10", "--out", out, "--rig"};
    arguments.insert(arguments.end(), rig.begin(), rig.end());
    run(arguments);
    return folder.read(out);
  };
  const std::string named_by_rig = plan("plan.csv", {"calibrated.toml"});
  EXPECT_THAT(named_by_rig, HasSubstr("constants bench of May"));
  EXPECT_EQ(plan("same.csv", {"nominal.toml", "--calibration", "calibration.json"}), named_by_rig);
  EXPECT_NE(rows_of(plan("nominal.csv", {"nominal.toml"})), rows_of(named_by_rig));

  const auto dry_run = [](const std::string& rig, const std::string& csv) {
    return std::vector<std::string>{"measure",       rig,        "--plan", csv, "--material",
                                    "builtin:slate", "--dry-run"};
  };
  EXPECT_THAT(run(dry_run("calibrated.toml", "plan.csv")).error, HasSubstr("10 direction(s)"));
  EXPECT_THAT(run(dry_run("calibrated.toml", "nominal.csv"), 2).error,
              HasSubstr("the joints do not realise this direction"));
}

TEST_F(Workflow, RefusesConstantsOfAnotherCameraBeforeAnythingMoves) {
  folder.write("calibration.json", run({"rig", "example", "--type", "calibration"}).out);
  const Ended refused =
      run({"measure", "rig.toml", "--plan", "list.csv", "--material", "builtin:red-pmma",
           "--calibration", "calibration.json", "--out", "session"},
          2);
  EXPECT_THAT(refused.error, HasSubstr("calibration is for 320 x 256 px"));
  EXPECT_FALSE(std::filesystem::exists(folder.path() / "session"));
}

}  // namespace
}  // namespace gonio
