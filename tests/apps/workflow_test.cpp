#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>
#include <csignal>
#include <nlohmann/json.hpp>
#include <sstream>

#include "workflow.h"

namespace gonio {
namespace {

using testing::HasSubstr;

TEST_F(Workflow, LeadsFromMaterialsToAReconstructionAndAReport) {
  train();
  run({"plan", "--basis", "basis.h5", "--samples", "6", "--rig", "rig.toml", "--out", "plan.csv"});
  run({"measure", "rig.toml", "--plan", "plan.csv", "--material", "builtin:pink-polypropylene",
       "--sample-id", "plate 7", "--repeat-pairs", "1", "--sentinel-every", "3", "--out",
       "session"});
  const auto status = nlohmann::json::parse(run({"status", "session", "--json"}).out);
  EXPECT_EQ(status["state"], "complete");
  EXPECT_EQ(status["measured"], 7) << "a pair with them";
  EXPECT_EQ(status["metadata"]["sample_id"], "plate 7");
  run({"reduce", "session", "--out", "samples.csv"});
  run({"reconstruct", "samples.csv", "--basis", "basis.h5", "--out", "found.binary"});
  const auto errors = nlohmann::json::parse(
      run({"compare", "builtin:pink-polypropylene", "found.binary", "--json"}).out);
  // Ten training materials are few: an order of magnitude better than a wrong material is what
  // shows that the chain holds together.
  EXPECT_GT(errors["psnr_a_db"].get<double>(), 24.0);
  EXPECT_LT(errors["weighted_log_rmse"].get<double>(), 0.35);
  run({"report", "session", "--basis", "basis.h5", "--out", "report.html"});
  const std::string report = folder.read("report.html");
  EXPECT_THAT(report, HasSubstr("plate 7"));
  EXPECT_THAT(report, HasSubstr("<em class=\"passed\">passed</em><b>Lamp</b><span>closing white"));
  EXPECT_THAT(report, HasSubstr("<em class=\"passed\">passed</em><b>Sentinel</b>"));
  EXPECT_THAT(report,
              HasSubstr("<em class=\"passed\">passed</em><b>Points measured twice</b><span>1 of"));
  run({"render", "found.binary", "--reference", "builtin:pink-polypropylene", "--size", "64",
       "--out", "spheres.png"});
  EXPECT_THAT(folder.read("spheres.png"), testing::StartsWith("\x89PNG"));
}

TEST_F(Workflow, ReportSaysWhatASessionFoundAgainstItself) {
  train();
  // Home marks that are found a tenth of a degree off each time: of a glossy sample it shows.
  folder.write("loose.toml", kSmallRig + "[simulation]\nhoming_sigma_deg = 0.1\n");
  folder.write(
      "glossy.csv",
      "theta_h_deg,theta_d_deg,phi_d_deg\n3,12,28\n5,60,89\n4,30,130\n2,60,180\n6,20,60\n");
  run({"measure", "loose.toml", "--plan", "glossy.csv", "--material", "builtin:blue-metallic",
       "--repeat-pairs", "2", "--sentinel-every", "1", "--out", "session"});
  run({"report", "session", "--basis", "basis.h5", "--out", "report.html"});
  const std::string report = folder.read("report.html");
  EXPECT_THAT(report, HasSubstr("<em class=\"remark\">remark</em><b>Sentinel</b>"));
  EXPECT_THAT(report, testing::ContainsRegex("off the first; [1-9] step\\(s\\)"));
  EXPECT_THAT(
      report,
      HasSubstr("<em class=\"remark\">remark</em><b>Points measured twice</b><span>1 of 2"));
}

TEST_F(Workflow, AddsMaterialsToABasisWithoutTheOldOnes) {
  train();
  run({"materials", "make", "measured", "--only", "red-pmma"});
  const Ended added = run({"train", "--append", "basis.h5", "builtin:graphite-metallic",
                           "measured/red-pmma.binary", "--source", "our-lab", "--out", "more.h5"});
  EXPECT_THAT(added.error + added.out, HasSubstr("12 materials (11 builtin, 1 our-lab)"));
  run({"plan", "--basis", "more.h5", "--samples", "4", "--out", "list-of-more.csv"});
  EXPECT_THAT(folder.read("list-of-more.csv"), HasSubstr("(12 materials)"));
}

TEST_F(Workflow, WritesBandsBesideAResultAndSaysWhetherToTrustIt) {
  train();
  run({"sample", "builtin:pink-polypropylene", "--directions", "list.csv", "--noise", "0.01",
       "--out", "samples.csv"});
  const std::vector<std::string> fit{"reconstruct", "samples.csv",  "--basis", "basis.h5",
                                     "--out",       "found.binary", "--json"};
  const auto verdict = nlohmann::json::parse(run(fit).out);
  EXPECT_TRUE(verdict["trusted"].is_null()) << "ten training materials are too few";
  EXPECT_THAT(verdict["line"].get<std::string>(), testing::StartsWith("cannot tell: "));
  const std::string bands = folder.read("found.uncertainty.h5");
  EXPECT_THAT(bands, testing::StartsWith("\x89HDF"));
  const auto sidecar = nlohmann::json::parse(folder.read("found.json"));
  EXPECT_EQ(sidecar["provenance"]["verdict"], verdict);
  EXPECT_THAT(bands, HasSubstr(sidecar["binary_sha256"].get<std::string>()));

  // Bands of an earlier result are an output like any other, and never stay beside another.
  std::filesystem::remove(folder.path() / "found.binary");
  std::filesystem::remove(folder.path() / "found.json");
  EXPECT_THAT(run(fit, 2).error, HasSubstr("found.uncertainty.h5"));
  EXPECT_FALSE(std::filesystem::exists(folder.path() / "found.binary"));
  std::vector<std::string> ridge = fit;
  ridge.insert(ridge.end(), {"--method", "ridge", "--force"});
  run(ridge);
  EXPECT_FALSE(std::filesystem::exists(folder.path() / "found.uncertainty.h5"));
  EXPECT_TRUE(std::filesystem::exists(folder.path() / "found.binary"));
}

TEST_F(Workflow, EndsWithFiveWhenAResultIsNotToBeTrusted) {
  train();
  // Values that no material of the ten comes near: dark at the peak, bright beside it.
  folder.write("samples.csv",
               "# radiometric_scale = si\n"
               "theta_h_deg,theta_d_deg,phi_d_deg,r,g,b,sigma_r,sigma_g,sigma_b\n"
               "0.5,12,28,0.001,0.02,0.9,0.0001,0.0001,0.001\n"
               "39,60,89,3,0.001,0.01,0.01,0.0001,0.001\n"
               "15,30,130,0.002,2,0.001,0.0001,0.01,0.0001\n"
               "2,60,180,0.9,0.002,0.003,0.001,0.0001,0.0001\n"
               "20,20,60,0.001,0.001,3,0.0001,0.0001,0.01\n");
  const Ended ended =
      run({"reconstruct", "samples.csv", "--basis", "basis.h5", "--out", "found.binary"}, 5);
  EXPECT_THAT(ended.out, testing::StartsWith("do not trust: "));
  EXPECT_EQ(std::count(ended.out.begin(), ended.out.end(), '\n'), 1);
  // The result is whole all the same.
  run({"compare", "builtin:red-pmma", "found.binary"});
  EXPECT_TRUE(std::filesystem::exists(folder.path() / "found.uncertainty.h5"));
}

TEST_F(Workflow, GivesTheSameBytesWithOneAndTwoThreads) {
  train();
  for (const std::string n : {"1", "2"}) {
    run({"plan", "--basis", "basis.h5", "--samples", "4", "--rig", "rig.toml", "--out",
         "plan" + n + ".csv", "--threads", n});
    run({"measure", "rig.toml", "--plan", "list.csv", "--material", "builtin:red-pmma", "--seed",
         "5", "--out", "session" + n, "--threads", n});
    run({"reduce", "session" + n, "--out", "samples" + n + ".csv", "--threads", n});
    // Five directions and ten training materials: it would reflect 123 % and is not to be trusted.
    run({"reconstruct", "samples" + n + ".csv", "--basis", "basis.h5", "--out",
         "found" + n + ".binary", "--threads", n},
        5);
  }
  EXPECT_EQ(folder.read("plan1.csv"), folder.read("plan2.csv"));
  EXPECT_EQ(folder.read("samples1.csv"), folder.read("samples2.csv"));
  EXPECT_TRUE(folder.read("found1.binary") == folder.read("found2.binary"));
  int frames = 0;
  for (const auto& entry :
       std::filesystem::directory_iterator(folder.path() / "session1" / "frames")) {
    const std::string name = entry.path().filename().string();
    EXPECT_TRUE(folder.read("session1/frames/" + name) == folder.read("session2/frames/" + name))
        << name;
    ++frames;
  }
  EXPECT_GT(frames, 30);
}

TEST_F(Workflow, SamplesAndEvaluatesMaterialsFromFiles) {
  run({"materials", "make", "files", "--only", "slate", "gold-satin", "red-pmma", "oak-oiled",
       "grey-abs", "blue-metallic"});
  run({"sample", "files/slate.binary", "--directions", "list.csv", "--rig", "rig.toml", "--noise",
       "0.01", "--seed", "3", "--out", "samples.csv"});
  const std::string samples = folder.read("samples.csv");
  EXPECT_EQ(std::count(samples.begin(), samples.end(), '\n'), 2 + 5 * 25);
  run({"sample", "files/slate.binary", "--directions", "list.csv", "--rig", "rig.toml", "--noise",
       "0.01", "--seed", "3", "--out", "again.csv", "--threads", "1"});
  EXPECT_EQ(folder.read("again.csv"), samples);
  const auto table = nlohmann::json::parse(
      run({"evaluate", "files", "--samples", "4,5", "--folds", "3", "--noise-common", "0.01",
           "--leave-one-out", "--weights", "image=0.5,uniform=0.5", "--json"})
          .out);
  ASSERT_EQ(table.size(), 5U);
  EXPECT_EQ(table[0]["samples"], 4);
  EXPECT_EQ(table[2]["samples"], 5);
  EXPECT_EQ(table[0]["materials"].size(), 6U);
  EXPECT_EQ(table[1]["method"], "4 chosen by leave-one-out");
  EXPECT_EQ(table[4]["method"], "published ten, eta 40");
  EXPECT_GT(table[0]["psnr_a_db"]["mean"].get<double>(), 5.0);
}

TEST_F(Workflow, DescribesTheReferenceRigAlsoAsChains) {
  folder.write("chains.toml", run({"rig", "example", "--type", "chains"}).out);
  const auto chains = nlohmann::json::parse(run({"rig", "check", "chains.toml", "--json"}).out);
  const auto short_form = nlohmann::json::parse(run({"rig", "check", "rig.toml", "--json"}).out);
  EXPECT_EQ(chains["reachable_cells"], short_form["reachable_cells"]);
  EXPECT_EQ(chains["published_ten_reached"], 10);
}

TEST_F(Workflow, LeavesOutUnreachableDirectionsWhenTold) {
  folder.write("list.csv", kList + "1,1,0\n");
  const Ended ended = run({"measure", "rig.toml", "--plan", "list.csv", "--material",
                           "builtin:red-pmma", "--out", "session", "--skip-unreachable"});
  EXPECT_THAT(ended.error, HasSubstr("OCCLUDED_LAMP"));
  const auto status = nlohmann::json::parse(run({"status", "session", "--json"}).out);
  EXPECT_EQ(status["measured"], 5);
}

TEST_F(Workflow, MeasuresASampleLargerThanTheWhiteReference) {
  folder.write("list.csv", "theta_h_deg,theta_d_deg,phi_d_deg\n3,12,28\n");
  folder.write("large.toml",
               kSmallRig + "[sample]\nhalf_width_mm = 40\n[white]\nhalf_width_mm = 25\n");
  folder.write("silent.toml", kSmallRig + "[sample]\nhalf_width_mm = 40\n");
  const auto red_values = [&](const std::string& rig) {
    run({"measure", rig + ".toml", "--plan", "list.csv", "--material", "builtin:ivory-wall-latex",
         "--out", rig});
    run({"reduce", rig, "--out", rig + ".csv"});
    std::istringstream lines(folder.read(rig + ".csv"));
    std::vector<double> red;
    for (std::string line; std::getline(lines, line);) {
      if (!std::isdigit(static_cast<unsigned char>(line[0]))) continue;
      std::istringstream cells(line);
      std::string cell;
      for (int column = 0; column < 4; ++column) std::getline(cells, cell, ',');
      red.push_back(std::stod(cell));
    }
    return red;
  };
  const std::vector<double> usual = red_values("rig");
  ASSERT_EQ(usual.size(), 25U);
  const auto [least, most] = std::minmax_element(usual.begin(), usual.end());
  // A matte paint: the same for all nearby directions. Holder and white would be far off.
  constexpr double kMatte = 0.1;
  for (const std::string rig : {"large", "silent"}) {
    const std::vector<double> red = red_values(rig);
    EXPECT_GE(red.size(), 15U) << "the outermost rows leave the view";
    for (const double value : red) {
      EXPECT_GT(value, (1.0 - kMatte) * *least) << rig;
      EXPECT_LT(value, (1.0 + kMatte) * *most) << rig;
    }
  }
}

TEST_F(Workflow, RefusesAWhitePatchThatLiesOnTheSample) {
  folder.write("rig.toml",
               kSmallRig + "[sample]\nhalf_width_mm = 40\n[white]\nplacement = \"in_frame\"\n");
  EXPECT_THAT(run({"rig", "check", "rig.toml"}, 2).error, HasSubstr("white.patch_mm"));
}

TEST_F(Workflow, TakesBackWhatItBeganWhenInterrupted) {
  GonioProcess demo({"demo", "--out", "demo"}, folder.path());
  ASSERT_TRUE(demo.wait_for("directions"));
  demo.send(SIGTERM);
  const Ended ended = demo.wait();
  EXPECT_EQ(ended.exit_code, 1) << ended.error;
  EXPECT_THAT(ended.error, HasSubstr("interrupted"));
  EXPECT_THAT(folder.names(), testing::ElementsAre("list.csv", "rig.toml"));
}

TEST_F(Workflow, AsksNobodyWithYesAndGivesUpWithoutAPerson) {
  folder.write("rig.toml", kSmallRig + "[white]\nplacement = \"manual\"\n");
  run({"measure", "rig.toml", "--plan", "list.csv", "--material", "builtin:red-pmma", "--out",
       "unattended", "--yes"});
  const Ended refused = run({"measure", "rig.toml", "--plan", "list.csv", "--material",
                             "builtin:red-pmma", "--out", "attended"},
                            3);
  EXPECT_THAT(refused.error, HasSubstr("found the end of standard input"));
}

}  // namespace
}  // namespace gonio
