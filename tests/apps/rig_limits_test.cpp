#include <gmock/gmock.h>

#include <nlohmann/json.hpp>

#include "bad_input.h"
#include "gonio/files/text_file.h"
#include "workflow.h"

namespace gonio {
namespace {

using testing::HasSubstr;

const std::string kHeaderLine = "theta_h_deg,theta_d_deg,phi_d_deg\n";

/// Limits of a rig as a rig file says them, with and without a calibration file.
class RigLimits : public Workflow {
 protected:
  /// Plans one direction on a rig file of these lines, besides the calibration file if one is
  /// named; the program's answer.
  Ended plan_one(const std::string& direction, const std::string& rig, int expected,
                 const std::string& calibration = "") {
    folder.write("limited.toml", rig);
    folder.write("one.csv", kHeaderLine + direction + "\n");
    std::vector<std::string> arguments{"plan",         "--directions", "one.csv",  "--rig",
                                       "limited.toml", "--out",        "plan.csv", "--force"};
    if (!calibration.empty()) {
      arguments.insert(arguments.end(), {"--calibration", calibration});
    }
    return run(arguments, expected);
  }

  void write_calibration() {
    folder.write("calibration.json", run({"rig", "example", "--type", "calibration"}).out);
  }
};

constexpr const char* kNearLamp = "3,12,28";  // the lamp stands 24 deg from the camera

TEST_F(RigLimits, HoldsTheRigFilesLimitsBesidesACalibration) {
  write_calibration();
  for (const std::string calibration : {"", "calibration.json"}) {
    plan_one(kNearLamp, "[rig]\n", 0, calibration);
    EXPECT_THAT(plan_one(kNearLamp, "[limits]\ntheta_i_max_deg = 5\n", 2, calibration).error,
                HasSubstr("GRAZING"));
    EXPECT_THAT(plan_one(kNearLamp, "[axis.lamp_arm]\nmin_deg = 60\n", 2, calibration).error,
                HasSubstr("AXIS_LIMIT"));
  }
}

TEST_F(RigLimits, HoldsACalibrationsLimitsBesidesAWiderRigFile) {
  auto constants = nlohmann::json::parse(run({"rig", "example", "--type", "calibration"}).out);
  constants["rig"]["theta_i_max_deg"] = 5.0;
  constants["rig"]["theta_o_max_deg"] = 5.0;
  folder.write("calibration.json", constants.dump());
  EXPECT_THAT(plan_one(kNearLamp, "[limits]\ntheta_i_max_deg = 85\n", 2, "calibration.json").error,
              HasSubstr("GRAZING"));
}

TEST_F(RigLimits, NamesBothFilesThatContradictEachOther) {
  write_calibration();
  for (const std::string axis :
       {"[axis.tilt]\nhome_deg = 5\n", "[axis.lamp_arm]\nmin_deg = 100\nhome_deg = 120\n"}) {
    const std::string error = plan_one(kNearLamp, axis, 2, "calibration.json").error;
    EXPECT_THAT(error, HasSubstr("calibration.json: rig.axes["));
    EXPECT_THAT(error, HasSubstr("limited.toml: axis."));
    EXPECT_THAT(error, HasSubstr("home_deg"));
  }
}

TEST_F(RigLimits, KeepsPosesOutOfABoxOfJointAngles) {
  write_calibration();
  const std::string box =
      "[[keep_out]]\nname = \"cable\"\n"
      "range = [{ axis = \"lamp_arm\", min_deg = 7.5, max_deg = 30 }]\n";
  for (const std::string calibration : {"", "calibration.json"}) {
    const std::string error = plan_one(kNearLamp, box, 2, calibration).error;
    EXPECT_THAT(error, HasSubstr("KEEP_OUT"));
    EXPECT_THAT(error, HasSubstr("cable"));
  }
  EXPECT_THAT(run({"rig", "check", "limited.toml"}).out, HasSubstr("KEEP_OUT"));
  EXPECT_THAT(run({"measure", "limited.toml", "--plan", "one.csv", "--material", "builtin:slate",
                   "--out", "session"},
                  2)
                  .error,
              HasSubstr("KEEP_OUT"));
  EXPECT_FALSE(std::filesystem::exists(folder.path() / "session"));
}

TEST_F(RigLimits, KeepsPathsOutOfABoxOfJointAngles) {
  const std::string wall =
      "[[keep_out]]\nname = \"post\"\n[[keep_out.range]]\naxis = \"lamp_arm\"\n"
      "min_deg = 40\nmax_deg = 80\n";
  EXPECT_THAT(plan_one(kNearLamp, wall, 2).error, HasSubstr("PATH_BLOCKED"));
}

TEST_F(RigLimits, KeepsTheSampleInSightOfTheCamera) {
  const std::string direction = "30,10,90";  // theta_o about 30 deg: 23 mm look like 20
  plan_one(direction, "[limits]\nmin_projected_half_width_mm = 15\n", 0);
  EXPECT_THAT(plan_one(direction, "[limits]\nmin_projected_half_width_mm = 22\n", 2).error,
              HasSubstr("FOOTPRINT"));
  // 23 mm at 350 mm are 3.8 deg.
  plan_one(direction, "[limits]\ncamera_half_field_deg = 5\n", 0);
  EXPECT_THAT(plan_one(direction, "[limits]\ncamera_half_field_deg = 3\n", 2).error,
              HasSubstr("FOOTPRINT"));
}

TEST_F(RigLimits, StoresAKeepOutWithTheSession) {
  folder.write("boxed.toml", kSmallRig +
                                 "[[keep_out]]\nname = \"cable\"\n[[keep_out.range]]\n"
                                 "axis = \"tilt\"\nmin_deg = 69\nmax_deg = 70\n");
  folder.write("one.csv", kHeaderLine + kNearLamp + "\n");
  run({"measure", "boxed.toml", "--plan", "one.csv", "--material", "builtin:slate", "--out",
       "session"});
  run({"reduce", "session", "--out", "samples.csv"});  // reads it back
}

TEST_F(RigLimits, ShowsAKeepOutInTheExample) {
  for (const std::string type : {"la2", "chains"}) {
    std::string example = run({"rig", "example", "--type", type}).out;
    for (std::size_t at = example.find("# [[keep_out]]"); at < example.size();
         at = example.find("\n# ", at)) {
      if (example[at] == '\n') ++at;
      example.erase(at, 2);
    }
    EXPECT_THAT(example, HasSubstr("\n[[keep_out.range]]\n"));
    folder.write("shown.toml", example);
    run({"rig", "check", "shown.toml"});
  }
}

TEST_F(Workflow, ShipsARigFileThatIsTheExample) {
  EXPECT_EQ(files::read_text_file(std::filesystem::path(GONIO_RIGS) / "simulated.toml", 1U << 20U),
            run({"rig", "example"}).out);
}

TEST_F(BadInput, NamesLineAndKeyOfAKeepOut) {
  const auto refused_box = [&](const std::string& lines, const std::vector<std::string>& words) {
    folder.write("box.toml", "[[keep_out]]\n" + lines);
    refused({"rig", "check", "box.toml"}, words);
  };
  const auto range = [](const std::string& keys) {
    return "name = \"cable\"\n[[keep_out.range]]\n" + keys;
  };
  refused_box("range = [{ axis = \"tilt\", min_deg = 1, max_deg = 70 }]\n",
              {"box.toml:1 keep_out[0].name", "found none"});
  refused_box("name = \"cable\"\n", {"box.toml:1 keep_out[0].range", "found none"});
  refused_box(range("axis = \"tild\"\n"),
              {"box.toml:4 keep_out[0].range[0].axis", "found \"tild\"", "\"lamp_arm\""});
  refused_box(range("min_deg = 1\nmax_deg = 2\n"),
              {"box.toml:3 keep_out[0].range[0].axis", "found none"});
  refused_box(range("axis = \"tilt\"\nmax_deg = 2\n"),
              {"box.toml:3 keep_out[0].range[0].min_deg", "found none"});
  refused_box(range("axis = \"tilt\"\nmin_deg = 2\n"),
              {"box.toml:3 keep_out[0].range[0].max_deg", "found none"});
  refused_box(range("axis = \"tilt\"\nmin_deg = 20\nmax_deg = 10\n"),
              {"box.toml:5 keep_out[0].range[0].min_deg", "found 20", "at most max_deg = 10"});
  refused_box(range("axis = \"tilt\"\nmin_deg = 71\nmax_deg = 80\n"),
              {"box.toml:5 keep_out[0].range[0].min_deg", "71 to 80", "travel of tilt, -5 to 70"});
  refused_box(range("axis = \"tilt\"\nmin_deg = -1\nmax_deg = 10\n"),
              {"box.toml:3 keep_out[0].range", "home"});
  refused_box(range("axis = \"tilt\"\nfrom = 1\n"), {"box.toml:5", "unknown key"});
}

}  // namespace
}  // namespace gonio
