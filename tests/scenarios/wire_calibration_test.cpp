// The calibration routine over the real protocols: the same hidden world, the same steps, other
// noise.

#include <gtest/gtest.h>

#include <cmath>
#include <set>
#include <string>
#include <vector>

#include "gonio/files/text_file.h"
#include "gonio/instrument/calibration_archive.h"
#include "gonio_process.h"
#include "temporary_folder.h"

namespace gonio {
namespace {

/// All devices but the monitor take part, and three of the targets; the whole routine stands in
/// docs/results.md (calibration_wire.sh).
const std::vector<std::string> kSteps{"homing",          "darks",      "linearity",
                                      "photon_transfer", "bad_pixels", "intrinsics"};
/// Says how bright the lamp was at the time; it warms up.
const std::set<std::string> kDrifts{"sensor.rate_dn_per_s"};

std::vector<std::string> calibration(const std::string& rig, const std::string& out) {
  std::vector<std::string> words{"calibrate", rig, "--out", out, "--yes", "-q"};
  for (const std::string& step : kSteps) words.insert(words.end(), {"--only", step});
  return words;
}

std::string rig_text(const std::string& name) {
  return files::read_text_file(std::string(GONIO_RIGS) + "/" + name, 1 << 20);
}

TEST(CalibrationOnTheWire, FindsWhatTheRoutineInProcessFinds) {
  const TemporaryFolder folder;
  folder.write("in_process.toml", rig_text("uncalibrated.toml"));
  folder.write("wire.toml", rig_text("uncalibrated_wire.toml"));
  // Not at the same time: the world on the wire does not wait for a busy machine.
  ASSERT_EQ(run_gonio(calibration("in_process.toml", "in_process"), folder.path()).exit_code, 0);
  std::vector<std::string> emulation{"wire.toml", "--time-scale", "30",         "--noise-seed",
                                     "2",         "--",           GONIO_PROGRAM};
  const std::vector<std::string> command = calibration("wire.toml", "wire");
  emulation.insert(emulation.end(), command.begin(), command.end());
  GonioProcess wire(emulation, folder.path(), 0, GONIO_EMULATE);
  const Ended ended = wire.wait();
  ASSERT_EQ(ended.exit_code, 0) << ended.error;

  const auto one =
      instrument::read_calibration_archive(folder.path() / "in_process" / "calibration.json");
  const auto other =
      instrument::read_calibration_archive(folder.path() / "wire" / "calibration.json");
  EXPECT_EQ(other.serials.at("tilt"), "K10CR1 serial 55000001");
  EXPECT_EQ(other.serials.at("changer"), "Modbus target changer");
  double squares = 0.0;
  int count = 0;
  for (const std::string& step : kSteps) {
    const instrument::StepResult* a = instrument::find_result(one, step);
    const instrument::StepResult* b = instrument::find_result(other, step);
    ASSERT_TRUE(a != nullptr && b != nullptr) << step;
    ASSERT_EQ(a->parameters.size(), b->parameters.size()) << step;
    for (std::size_t i = 0; i < a->parameters.size(); ++i) {
      const std::string& name = a->parameters[i].name;
      ASSERT_EQ(b->parameters[i].name, name);
      const auto k = static_cast<Eigen::Index>(i);
      const double variance = a->covariance(k, k) + b->covariance(k, k);
      if (!(variance > 0.0) || kDrifts.contains(name)) continue;
      const double difference = a->parameters[i].value - b->parameters[i].value;
      EXPECT_LT(std::abs(difference), 4.0 * std::sqrt(variance))
          << step << " " << name << " " << a->parameters[i].value;
      squares += difference * difference / variance;
      ++count;
    }
  }
  ASSERT_GE(count, 21);
  RecordProperty("chi2_per_dof", std::to_string(squares / count));
  EXPECT_LT(squares / count, 2.0);
}

}  // namespace
}  // namespace gonio
