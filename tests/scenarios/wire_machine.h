#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "gonio/samples/samples.h"
#include "gonio_process.h"
#include "temporary_folder.h"

/// What tests of the programs over the real protocols share: `gonio` drives what `gonio-emulate`
/// puts on the wire.
namespace gonio {

/// rigs/wire.toml at a sixteenth of the pixels. Sixteen whites, because what is left of their noise
/// moves all samples of a session together; no fixed pattern, because it is in a sample's sigma and
/// the same in two sessions of one sensor.
inline std::string small_wire_rig() {
  std::ifstream file(std::string(GONIO_RIGS) + "/wire.toml");
  return std::string(std::istreambuf_iterator<char>(file), {}) + R"(
[camera]
width_px = 80
height_px = 64
fx_px = 345.0
fy_px = 345.0
cx_px = 39.5
cy_px = 31.5
prnu = 0
dsnu_e = 0
[session]
white_frames = 16
dark_frames = 4
[simulation]
material = "builtin:gold-satin"
)";
}

class OnTheWire : public testing::Test {
 protected:
  void SetUp() override {
    folder_.write("rig.toml", small_wire_rig());
    folder_.write("list.csv",
                  "theta_h_deg,theta_d_deg,phi_d_deg\n3,12,28\n39,60,89\n15,30,130\n2,60,180\n"
                  "20,20,60\n");
  }

  static std::vector<std::string> words(std::vector<std::string> first,
                                        const std::vector<std::string>& then) {
    first.insert(first.end(), then.begin(), then.end());
    return first;
  }

  Ended gonio(const std::vector<std::string>& arguments, int expected = 0) {
    const Ended ended = run_gonio(arguments, folder_.path());
    EXPECT_EQ(ended.exit_code, expected) << testing::PrintToString(arguments) << ended.error;
    return ended;
  }

  /// `gonio ARGUMENTS` inside the emulated machine.
  Ended emulated(const std::vector<std::string>& options, const std::vector<std::string>& arguments,
                 int expected = 0) {
    const Ended ended =
        GonioProcess(emulation(options, arguments), folder_.path(), 0, GONIO_EMULATE).wait();
    EXPECT_EQ(ended.exit_code, expected) << testing::PrintToString(arguments) << ended.error;
    return ended;
  }

  static std::vector<std::string> emulation(const std::vector<std::string>& options,
                                            const std::vector<std::string>& arguments) {
    return words(words({"rig.toml"}, options), words({"--", GONIO_PROGRAM}, arguments));
  }

  /// Drives that say whether they are homed, so that the next program need not home them.
  void use_drives_that_know_their_home() {
    std::string rig = small_wire_rig();
    const std::string az = "profile = \"oriental-az\"";
    rig.replace(rig.find(az), az.size(),
                "profile = \"leadshine-em2rs\"\nconfirmed = [\"home\", \"stop\"]");
    folder_.write("rig.toml", rig);
  }

  /// Its drive has been seen to count on until it is home.
  void let_the_lamp_arm_tell() {
    std::string rig = small_wire_rig();
    const std::string profile = "profile = \"leadshine-em2rs\"\n";
    rig.insert(rig.find(profile) + profile.size(), "counts_until_homed = true\n");
    folder_.write("rig.toml", rig);
  }

  /// A script of bash inside the emulated machine, in which time goes four times as fast.
  Ended in_the_machine(const std::string& script, const std::vector<std::string>& options = {}) {
    return GonioProcess(
               words(words({"rig.toml", "--time-scale", "4"}, options), {"--", "bash", script}),
               folder_.path(), 0, GONIO_EMULATE)
        .wait();
  }

  samples::SampleSet reduced(const std::string& session) {
    gonio({"reduce", session, "--out", session + ".csv"});
    return samples::read_samples(folder_.path() / (session + ".csv"));
  }

  TemporaryFolder folder_;
};

}  // namespace gonio
