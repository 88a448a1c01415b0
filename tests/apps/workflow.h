#pragma once

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "gonio_process.h"
#include "temporary_folder.h"

/// What tests of several subcommands in a row share.
namespace gonio {

/// Bytes: more than any file of these tests has.
inline constexpr std::size_t kEnough = 1U << 24U;

/// The nominal view on a sixteenth of the pixels, so that a session takes a second.
inline const std::string kSmallRig = R"([camera]
width_px = 80
height_px = 64
fx_px = 345.0
fy_px = 345.0
cx_px = 39.5
cy_px = 31.5
[session]
white_frames = 2
dark_frames = 2
)";

/// For a rig file: nothing but noise is random, and what it is does not depend on what came before.
inline const std::string kSteadyWorld = R"([white]
placement = "in_frame"
[simulation]
homing_sigma_deg = 0.0
positioning_sigma_deg = 0.0
lamp_drift_sigma = 0.0
same_noise_again = true
)";

inline const std::string kList =
    "theta_h_deg,theta_d_deg,phi_d_deg\n3,12,28\n39,60,89\n15,30,130\n2,60,180\n20,20,60\n";

/// Ten materials of several families, none of them the one that is measured.
inline const std::vector<std::string> kTrain{"train",
                                             "builtin:white-ptfe",
                                             "builtin:grey-abs",
                                             "builtin:gold-satin",
                                             "builtin:slate",
                                             "builtin:signal-red-enamel",
                                             "builtin:blue-metallic",
                                             "builtin:oak-oiled",
                                             "builtin:red-felt",
                                             "builtin:silicone-red",
                                             "builtin:ivory-wall-latex"};

/// A folder with rig.toml (kSmallRig) and list.csv (kList).
class Workflow : public testing::Test {
 protected:
  void SetUp() override {
    folder.write("rig.toml", kSmallRig);
    folder.write("list.csv", kList);
  }

  /// Runs gonio in the folder; fails unless it ends with `expected`.
  Ended run(std::vector<std::string> arguments, int expected = 0) {
    const Ended ended = run_gonio(arguments, folder.path());
    EXPECT_EQ(ended.exit_code, expected) << testing::PrintToString(arguments) << "\n"
                                         << ended.error;
    return ended;
  }

  /// Writes basis.h5 of kTrain.
  void train() {
    std::vector<std::string> arguments = kTrain;
    arguments.insert(arguments.end(), {"--out", "basis.h5", "--components", "9"});
    run(arguments);
  }

  TemporaryFolder folder;
};

}  // namespace gonio
