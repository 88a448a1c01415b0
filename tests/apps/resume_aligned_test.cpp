// Sessions on a calibration with an aligned sample, gone on with after a kill.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <csignal>
#include <nlohmann/json.hpp>

#include "gonio/acquisition/session_archive.h"
#include "gonio/files/text_file.h"
#include "workflow.h"

namespace gonio {
namespace {

using testing::HasSubstr;

class ResumeAligned : public Workflow {
 protected:
  void SetUp() override {
    Workflow::SetUp();
    folder.write("slow.toml", kSmallRig + kSteadyWorld + "time_scale = 60.0\n");
    run({"calibrate", "rig.toml", "--out", "cal", "--yes", "--only", "darks"});
    // Its constants, as if the other steps had passed too.
    folder.write("fast.toml", kSmallRig + kSteadyWorld);
    run({"measure", "fast.toml", "--plan", "list.csv", "--material", "builtin:grey-abs", "--out",
         "before"});
    const acquisition::SessionReader session(folder.path() / "before");
    folder.write("cal/instrument.json", session.configuration().at("calibration.json"));
    run({"align", "fast.toml", "--calibration", "cal", "--out", "a.json", "--seat-sigma", "0.1",
         "--accept-calibration"});
    GonioProcess measuring({"measure", "slow.toml", "--plan", "list.csv", "--material",
                            "builtin:grey-abs", "--calibration", "cal", "--alignment", "a.json",
                            "--accept-calibration", "--out", "session", "--verbose"},
                           folder.path());
    ASSERT_TRUE(measuring.wait_for("point 1, 1 of"));
    measuring.send(SIGKILL);
    measuring.wait();
  }
};

TEST_F(ResumeAligned, AnAlignedSessionOnACalibrationGoesOn) {
  run({"resume", "session"});
  const auto status = nlohmann::json::parse(run({"status", "session", "--json"}).out);
  EXPECT_EQ(status["state"], "complete");
  EXPECT_EQ(status["metadata"]["alignment"], "seat");
  EXPECT_THAT(status["metadata"]["calibration_folder"].get<std::string>(), HasSubstr("cal"));
}

}  // namespace
}  // namespace gonio
