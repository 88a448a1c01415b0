#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "gonio_process.h"
#include "temporary_folder.h"

namespace gonio {
namespace {

using testing::HasSubstr;
using testing::StartsWith;

class Convert : public testing::Test {
 protected:
  Ended run(const std::vector<std::string>& arguments) {
    const Ended ended = run_gonio(arguments, folder.path());
    EXPECT_EQ(ended.exit_code, 0) << testing::PrintToString(arguments) << "\n" << ended.error;
    return ended;
  }
  double log_rmse(const std::string& a, const std::string& b) {
    return nlohmann::json::parse(
        run({"compare", a, b, "--scale", "si", "--json"}).out)["weighted_log_rmse"];
  }

  TemporaryFolder folder;
};

/// Weighted log RMSE that a gloss paint may lose on a warped grid of 64 x 64 for lights 3 deg
/// apart.
constexpr double kResampled = 0.02;

TEST_F(Convert, ToRglAndBackCostsLittle) {
  const Ended said = run({"convert", "builtin:signal-red-enamel", "a.bsdf"});
  EXPECT_THAT(said.error, HasSubstr("read back, it differs by 0.0"));
  EXPECT_LT(log_rmse("builtin:signal-red-enamel", "a.bsdf"), kResampled);
  const Ended back = run({"convert", "a.bsdf", "b.binary"});
  EXPECT_THAT(back.error, HasSubstr("reciprocal within"));
  EXPECT_EQ(log_rmse("a.bsdf", "b.binary"), 0.0);
}

TEST_F(Convert, ToCsvAndBackIsExact) {
  run({"convert", "builtin:slate", "a.binary"});
  run({"convert", "a.binary", "a.csv"});
  EXPECT_THAT(folder.read("a.csv"),
              StartsWith("# radiometric_scale = si\ntheta_h_deg,theta_d_deg,phi_d_deg,r,g,b\n"));
  run({"convert", "a.csv", "b.binary"});
  const std::string a = folder.read("a.binary");
  EXPECT_TRUE(a == folder.read("b.binary"));
}

TEST_F(Convert, ChangesTheScaleOnlyWhenAsked) {
  run({"convert", "builtin:slate", "merl.binary", "--scale", "merl", "--merl-to-si", "3"});
  EXPECT_THAT(folder.read("merl.json"), HasSubstr("\"radiometric_scale\": \"merl\""));
  const auto same = nlohmann::json::parse(run({"compare", "builtin:slate", "merl.binary", "--scale",
                                               "si", "--merl-to-si", "3", "--json"})
                                              .out);
  EXPECT_LT(same["weighted_log_rmse"].get<double>(), 1e-9);
  run({"train", "builtin:slate", "builtin:oak-oiled", "merl.binary", "--scale", "si",
       "--merl-to-si", "3", "--out", "basis.h5"});
}

TEST_F(Convert, WritesScenesBesideTheirMaterial) {
  run({"render", "builtin:gold-satin", "--scene", "mitsuba", "--out", "gold & co.xml"});
  EXPECT_THAT(folder.names(), testing::ElementsAre("gold & co.bsdf", "gold & co.xml"));
  const std::string mitsuba = folder.read("gold & co.xml");
  EXPECT_THAT(mitsuba, HasSubstr("<bsdf type=\"measured\">"));
  EXPECT_THAT(mitsuba, HasSubstr("name=\"filename\" value=\"gold &amp; co.bsdf\""));
  run({"render", "builtin:gold-satin", "--scene", "pbrt", "--out", "gold.pbrt"});
  EXPECT_THAT(folder.read("gold.pbrt"),
              HasSubstr("Material \"measured\" \"string filename\" [ \"gold.bsdf\" ]"));
  EXPECT_THAT(folder.read("gold.bsdf"), StartsWith("tensor_file"));
}

}  // namespace
}  // namespace gonio
