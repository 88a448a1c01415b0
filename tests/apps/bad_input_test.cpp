#include <cstring>

#include "bad_input.h"

namespace gonio {
namespace {

TEST_F(BadInput, NamesFileAndByteOfABrokenMerlFile) {
  std::string bytes = merl_file(1.0);
  folder.write("short.binary", bytes.substr(0, 1000));
  refused({"compare", "builtin:slate", "short.binary"}, {"short.binary", "1000", "34992012"});
  folder.write("long.binary", bytes + "x");
  refused({"compare", "builtin:slate", "long.binary"}, {"long.binary", "34992013"});
  std::string dimensions = bytes;
  dimensions[0] = 91;
  folder.write("dimensions.binary", dimensions);
  refused({"compare", "builtin:slate", "dimensions.binary"}, {"91 x 90 x 180", "90 x 90 x 180"});
  std::string nan = bytes;
  const double not_a_number = std::numeric_limits<double>::quiet_NaN();
  std::memcpy(nan.data() + kHeaderBytes + 800, &not_a_number, sizeof not_a_number);
  folder.write("nan.binary", nan);
  refused({"train", "nan.binary", "nan.binary", "--out", "basis.h5"}, {"nan"});
  refused({"render", "nan.binary", "--out", "x.png"}, {"nan.binary", "byte 812", "NaN"});
  folder.write("invalid.binary", merl_file(-1.0));
  refused({"compare", "builtin:slate", "invalid.binary"}, {"invalid.binary", "no valid cell"});
}

TEST_F(BadInput, NamesFieldAndByteOfABrokenRglFile) {
  folder.write("magic.bsdf", "tensor_fool and more");
  folder.write("short.bsdf", std::string("tensor_file\0\1\0\5\0\0\0", 18));
  for (const std::string name : {"magic.bsdf", "short.bsdf"}) {
    const std::string place = name == "magic.bsdf" ? "byte 0" : "byte 18";
    refused({"render", name, "--out", "x.png"}, {name, place});
    refused({"compare", "builtin:slate", name}, {name, place});
    refused({"train", "builtin:slate", name, "--out", "basis.h5"}, {name, place});
  }
  folder.write("list.csv", kHeader + std::string("10,20,30\n"));
  refused({"sample", "magic.bsdf", "--directions", "list.csv", "--out", "s.csv"}, {"magic.bsdf"});
}

TEST_F(BadInput, NamesTheLineOfABrokenCornellFile) {
  folder.write("word.brdf", "# paint\n2\n400 700\n0.1 0 0.2 3.14 one 1\n");
  folder.write("few.brdf", "2\n400 700\n0.1 0 0.2 3.14 1 1\n");
  refused({"render", "word.brdf", "--out", "x.png"}, {"word.brdf", "line 4", "\"one\""});
  refused({"compare", "builtin:slate", "few.brdf"}, {"few.brdf", "found 1 samples, expected"});
  refused({"train", "builtin:slate", "word.brdf", "--out", "basis.h5"}, {"word.brdf", "line 4"});
  refused({"convert", "word.brdf", "x.binary"}, {"word.brdf", "line 4"});
}

TEST_F(BadInput, NamesWhatCannotBeConverted) {
  folder.write("a.binary", merl_file(1.0));
  refused({"convert", "a.binary", "x.exr"}, {"x.exr", "expected .binary, .bsdf or .csv"});
  refused({"convert", "a.binary", "x.bsdf"}, {"a.binary", "found merl, expected si"});
  refused({"convert", "a.binary", "a.binary", "--force"}, {"a.binary", "is an input"});
  refused({"convert", "builtin:slate", "no/such/x.bsdf"}, {"no/such"});
  folder.write("few.csv",
               "# radiometric_scale = si\n" + std::string(kSampleHeader) + "10,20,30,1,2,3\n");
  refused({"convert", "few.csv", "x.binary"}, {"few.csv", "found 1 samples, expected"});
  refused({"render", "a.binary", "--scene", "mitsuba", "--out", "x.xml"},
          {"a.binary", "found merl, expected si"});
  refused({"render", "builtin:slate", "--scene", "pbrt", "--out", "no/such/x.pbrt"}, {"no/such"});
  refused({"render", "builtin:slate", "--scene", "povray", "--out", "x"}, {"--scene", "povray"});
}

TEST_F(BadInput, NamesMaterialsOfDifferentScale) {
  folder.write("a.binary", merl_file(1.0));
  refused({"train", "builtin:slate", "a.binary", "--out", "basis.h5"},
          {"slate is in scale si", "a in scale merl", "--scale"});
  refused({"train", "builtin:slate", "a.binary", "--out", "basis.h5", "--scale", "lux"},
          {"--scale", "lux"});
}

TEST_F(BadInput, NamesLineAndKeyOfARigFile) {
  folder.write("unknown.toml", "[camera]\nwidth_pix = 3\n");
  refused({"rig", "check", "unknown.toml"},
          {"unknown.toml:2 camera.width_pix", "unknown key", "did you mean \"width_px\"?"});
  folder.write("range.toml", "[session]\n\nbracket_ratio = 1000\n");
  refused({"rig", "check", "range.toml"},
          {"range.toml:3 session.bracket_ratio", "found 1000", "expected 1.01 to 64"});
  folder.write("type.toml", "[camera]\nwidth_px = \"wide\"\n");
  refused({"rig", "check", "type.toml"}, {"type.toml:2 camera.width_px", "found text"});
  folder.write("limits.toml", "[axis.tilt]\nmin_deg = 80\n");
  refused({"rig", "check", "limits.toml"}, {"limits.toml:2 axis.tilt.min_deg", "found 80"});
  folder.write("syntax.toml", "[camera\n");
  refused({"rig", "check", "syntax.toml"}, {"syntax.toml:1"});
  folder.write("driver.toml", "[rig]\ndriver = \"real\"\n");
  refused({"rig", "check", "driver.toml"}, {"driver.toml:2 rig.driver", "simulated"});
  refused({"rig", "check", "missing.toml"}, {"missing.toml"});
}

TEST_F(BadInput, NamesDirectionsThatCannotBeMeasured) {
  folder.write("rig.toml", "[rig]\nname = \"r\"\n");
  const auto measure = [](const std::string& plan) {
    return std::vector<std::string>{"measure", "rig.toml", "--plan",     plan,
                                    "--out",   "session",  "--material", "builtin:slate"};
  };
  folder.write("horizon.csv", kHeader + std::string("10,20,30\n80,80,0\n"));
  refused(measure("horizon.csv"), {"horizon.csv", "line 3", "BELOW_HORIZON"});
  refused({"plan", "--directions", "horizon.csv", "--rig", "rig.toml", "--out", "plan.csv"},
          {"horizon.csv", "line 3"});
  refused({"plan", "--samples", "3", "--basis", "basis.h5", "--rig", "rig.toml", "--patch", "-3",
           "--out", "plan.csv"},
          {"--patch", "found '-3'", "expected auto, 0 or 0.1 to 500 mm"});
  refused({"plan", "--samples", "3", "--basis", "basis.h5", "--rig", "rig.toml", "--patch",
           "1e-300", "--out", "plan.csv"},
          {"--patch", "found '1e-300'", "expected auto, 0 or 0.1 to 500 mm"});
  refused({"plan", "--near-field", "--samples", "3", "--out", "plan.csv"}, {"--near-field"});
  folder.write("near.csv", kHeader + std::string("1,1,0\n"));
  refused(measure("near.csv"), {"near.csv", "line 2", "OCCLUDED_LAMP", "1.00"});
  folder.write("twice.csv", kHeader + std::string("10,20,30\n5,5,5\n10,20,30\n"));
  refused(measure("twice.csv"), {"twice.csv", "line 4", "line 2"});
  folder.write("range.csv", kHeader + std::string("10,120,30\n"));
  refused(measure("range.csv"), {"range.csv", "line 2", "theta_d_deg"});
  folder.write("words.csv", kHeader + std::string("10,x,30\n"));
  refused(measure("words.csv"), {"words.csv", "line 2", "theta_d_deg"});
}

TEST_F(BadInput, RefusesPosesThatDoNotBelongToTheirDirections) {
  folder.write("rig.toml", "[rig]\nname = \"r\"\n");
  folder.write("list.csv", kHeader + std::string("3,12,28\n"));
  ASSERT_EQ(
      run_gonio({"plan", "--directions", "list.csv", "--rig", "rig.toml", "--out", "plan.csv"},
                folder.path())
          .exit_code,
      0);
  std::string plan = folder.read("plan.csv");
  plan.replace(plan.find("\n3,12,28"), 8, "\n4,12,28");
  folder.write("edited.csv", plan);
  refused({"measure", "rig.toml", "--plan", "edited.csv", "--out", "session", "--material",
           "builtin:slate"},
          {"edited.csv", "joints do not realise"});
}

TEST_F(BadInput, NamesWhatCannotBeAppendedToABasis) {
  ASSERT_EQ(run_gonio({"train", "builtin:slate", "builtin:gold-satin", "--out", "basis.h5"},
                      folder.path())
                .exit_code,
            0);
  const auto append = [](const std::string& basis, const std::string& material) {
    return std::vector<std::string>{"train", "--append", basis, material, "--out", "more.h5"};
  };
  refused(append("missing.h5", "builtin:red-pmma"), {"missing.h5"});
  folder.write("text.h5", "components");
  refused(append("text.h5", "builtin:red-pmma"), {"text.h5", "not a readable HDF5 file"});
  refused(append("basis.h5", "builtin:slate"), {"\"slate\"", "already in basis.h5"});
  folder.write("merl.binary", merl_file(0.5));
  refused(append("basis.h5", "merl.binary"), {"scale merl", "basis.h5 is in scale si"});
  refused({"train", "--append", "basis.h5", "builtin:red-pmma", "--out", "basis.h5", "--force"},
          {"basis.h5", "is an input"});
  folder.write("other.binary", merl_file(0.6));
  refused({"train", "merl.binary", "other.binary", "--out", "merl.binary", "--force"},
          {"merl.binary", "is an input"});
  refused({"train", "builtin", "--source", "a\nb", "--out", "more.h5"}, {"--source"});
  refused({"train", "builtin", "--components", "0", "--out", "more.h5"}, {"--components"});
  EXPECT_FALSE(std::filesystem::exists(folder.path() / "more.h5"));
}

TEST_F(BadInput, NamesANumberThatIsNone) {
  for (const std::string option : {"--noise", "--time-price", "--fov"}) {
    refused({"plan", "--samples", "4", "--basis", "basis.h5", option, "nan", "--out", "plan.csv"},
            {option, "nan"});
  }
}

// X.binary is written with X.json beside it.
TEST_F(BadInput, KeepsAnInputOfTheSidecarsName) {
  folder.write("found.json", kSampleHeader);
  refused({"reconstruct", "found.json", "--basis", "basis.h5", "--out", "found.binary", "--force"},
          {"found.json", "is an input"});
  std::filesystem::create_symlink("found.json", folder.path() / "link.csv");
  refused({"convert", "link.csv", "found.binary", "--force"}, {"found.json", "is an input"});
}

TEST_F(BadInput, RefusesATiltOfNearFieldPhotographs) {
  folder.write("shots.csv", kHeader + std::string("6,23,41\n"));
  refused({"sample", "builtin:slate", "--directions", "shots.csv", "--near-field", "--angle-error",
           "0.05", "--out", "s.csv"},
          {"--angle-error", "near-field"});
  refused({"evaluate", "builtin", "--shots", "2", "--angle-error", "0.05"},
          {"--angle-error", "near-field"});
}

TEST_F(BadInput, RefusesSiblingsThatABasisKnowsOtherwise) {
  folder.write("first.csv", "material,group\nslate,stone\n");
  ASSERT_EQ(run_gonio({"train", "builtin:slate", "builtin:oak-oiled", "--siblings", "first.csv",
                       "--out", "grouped.h5"},
                      folder.path())
                .exit_code,
            0);
  folder.write("other.csv", "material,group\nslate,wood\nred-pmma,wood\n");
  refused({"train", "--append", "grouped.h5", "builtin:red-pmma", "--siblings", "other.csv",
           "--out", "more.h5"},
          {"other.csv", "slate", "wood", "stone"});
  folder.write("long.csv", "material,group\nslate," + std::string(300, 'g') + "\n");
  refused(
      {"train", "builtin:slate", "builtin:oak-oiled", "--siblings", "long.csv", "--out", "more.h5"},
      {"long.csv", "line 2", "300 bytes"});
}

TEST_F(BadInput, NamesTheLineOfAMaterialWithTwoGroups) {
  folder.write("siblings.csv", "material,group\nslate,a\nslate,a\nslate,b\n");
  refused({"evaluate", "builtin:slate", "builtin:red-pmma", "builtin:oak-oiled", "builtin:grey-abs",
           "--folds", "2", "--siblings", "siblings.csv"},
          {"siblings.csv", "line 4", "slate"});
  folder.write("others.csv", "material,group\nslat,a\n");
  refused({"evaluate", "builtin:slate", "builtin:red-pmma", "builtin:oak-oiled", "builtin:grey-abs",
           "--folds", "2", "--siblings", "others.csv"},
          {"others.csv", "names none of the 4 materials"});
}

TEST_F(BadInput, NamesAMaterialWithoutAnyLight) {
  for (const double value : {0.0, 1e300}) {
    folder.write("odd.binary", merl_file(value));
    const std::string what = value > 0.0 ? "expected at most 1e+09" : "found no value above 0";
    refused({"compare", "builtin:slate", "odd.binary"}, {"odd.binary", what});
    refused({"train", "odd.binary", "odd.binary", "--out", "basis.h5"}, {"odd"});
  }
}

TEST_F(BadInput, RefusesWeightsThatSayNothing) {
  for (const std::string weights :
       {"sky", "image=x", "image=-1", "uniform=0", "image=1,", "", "image=1,image=2"}) {
    refused({"plan", "--samples", "4", "--basis", "basis.h5", "--weights", weights, "--out",
             "plan.csv"},
            {"--weights"});
  }
  refused(
      {"plan", "--samples", "4", "--basis", "basis.h5", "--time-price", "1", "--out", "plan.csv"},
      {"--time-price", "--rig"});
}

TEST_F(BadInput, RefusesOptionsThatWouldChangeNothing) {
  using Words = std::vector<std::string>;
  const auto refused_after = [&](Words words, const Words& option) {
    words.insert(words.end(), option.begin(), option.end());
    words.insert(words.end(), {"--out", "out.csv"});
    refused(words, {option.front()});
  };
  for (const Words& option :
       {Words{"--method", "xu"}, Words{"--objective", "d"}, Words{"--time-price", "1"},
        Words{"--patch", "10"}, Words{"--explain"}, Words{"--json"}, Words{"--skip-unreachable"},
        Words{"--calibration", "c.json"}}) {
    refused_after({"plan", "--near-field", "--basis", "basis.h5"}, option);
  }
  for (const Words& option :
       {Words{"--method", "xu"}, Words{"--objective", "d"}, Words{"--noise", "0.1"},
        Words{"--weights", "uniform"}, Words{"--patch", "10"}, Words{"--shots", "3"},
        Words{"--fov", "30"}, Words{"--calibration", "c.json"}, Words{"--skip-unreachable"}}) {
    refused_after({"plan", "--directions", "nielsen-10"}, option);
  }
  for (const Words& option :
       {Words{"--objective", "d"}, Words{"--noise", "0.1"}, Words{"--weights", "uniform"}}) {
    refused_after({"plan", "--samples", "3", "--basis", "basis.h5", "--method", "xu"}, option);
  }
  folder.write("rig.toml", "[rig]\nname = \"r\"\n");
  folder.write("list.csv", kHeader + std::string("10,20,30\n"));
  const Words sample{"sample", "builtin:slate", "--directions", "list.csv"};
  refused_after(sample, {"--lamp-mm", "500"});
  Words near = sample;
  near.emplace_back("--near-field");
  refused_after(near, {"--rig", "rig.toml"});
  refused({"evaluate", "builtin", "--camera-mm", "200"}, {"--camera-mm", "--shots"});
}

TEST_F(BadInput, NamesTheRowOfBadSamples) {
  ASSERT_EQ(run_gonio({"train", "builtin:slate", "builtin:gold-satin", "builtin:red-pmma", "--out",
                       "basis.h5"},
                      folder.path())
                .exit_code,
            0);
  const auto reconstruct = [](const std::string& samples) {
    return std::vector<std::string>{"reconstruct", samples, "--basis",
                                    "basis.h5",    "--out", "x.binary"};
  };
  folder.write("none.csv", kSampleHeader);
  refused(reconstruct("none.csv"), {"none.csv", "at least one sample"});
  folder.write("two.csv", kSampleHeader + std::string("10,20,30,1,2\n"));
  refused(reconstruct("two.csv"), {"two.csv", "line 2", "found 5 cells, expected 6"});
  folder.write("columns.csv", "theta_h_deg,theta_d_deg,phi_d_deg,r,g\n10,20,30,1,2\n");
  refused(reconstruct("columns.csv"), {"columns.csv"});
  folder.write("merl.csv",
               "# radiometric_scale = merl\n" + std::string(kSampleHeader) + "10,20,30,1,2,3\n");
  refused(reconstruct("merl.csv"), {"merl.csv", "found merl", "expected si",
                                    "\n  samples in the scale of the MERL files need"});
  folder.write("good.csv",
               "# radiometric_scale = si\n" + std::string(kSampleHeader) + "10,20,30,1,2,3\n");
  refused({"reconstruct", "good.csv", "--basis", "good.csv", "--out", "x.binary"}, {"good.csv"});
  refused({"reconstruct", "good.csv", "--basis", "basis.h5", "--out", "good.csv", "--force"},
          {"good.csv", "is an input of this command"});
  refused({"reconstruct", "good.csv", "--basis", "basis.h5", "--out", "merl.csv"},
          {"merl.csv", "it exists"});
  refused({"reconstruct", "good.csv", "--basis", "basis.h5", "--out", "no/such/x.binary"},
          {"no/such/x.binary"});
  refused({"reconstruct", "good.csv", "--basis", "basis.h5", "--out", "x.binary", "--eta", "-3"},
          {"--eta", "-3"});
}

TEST_F(BadInput, RefusesWhatIsNoSession) {
  folder.write("rig.toml", "[rig]\nname = \"r\"\n");
  folder.write("list.csv", kHeader + std::string("3,12,28\n"));
  refused({"reduce", ".", "--out", "samples.csv"}, {"session.sqlite"});
  refused({"status", "nowhere"}, {"nowhere"});
  refused({"measure", "rig.toml", "--plan", "list.csv", "--out", "list.csv", "--material",
           "builtin:slate"},
          {"list.csv", "it exists"});
  refused({"measure", "rig.toml", "--plan", "list.csv", "--out", "session"},
          {"nothing lies on the simulated rig"});
  refused({"materials", "verify", "."}, {"no file of the MERL database"});
}

}  // namespace
}  // namespace gonio
