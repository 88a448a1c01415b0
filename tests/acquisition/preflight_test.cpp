#include "gonio/acquisition/preflight.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "fake_rig.h"
#include "gonio/acquisition/disk.h"
#include "gonio/errors/errors.h"
#include "temporary_folder.h"

namespace gonio::acquisition {
namespace {

using testing::HasSubstr;

const std::vector<std::array<double, 3>> kDirections{
    {3.0, 12.0, 28.0}, {15.0, 30.0, 130.0}, {20.0, 20.0, 60.0}};

class PreflightOf : public testing::Test {
 protected:
  Preflight look(const Expectation* expectation = nullptr) {
    return preflight(rig_.devices(), rig_.known, plan_, options_, expectation);
  }
  static Check check(const Preflight& found, const std::string& name) {
    for (const Check& each : found.checks) {
      if (each.name == name) return each;
    }
    ADD_FAILURE() << "no check named " << name;
    return {};
  }
  /// A light under which a white comes to `white_dn_per_s` at its pose, and a sample of this BRDF.
  Expectation expectation(double white_dn_per_s, double brdf) const {
    Expectation expected;
    constexpr double kLampDistance_mm = 500.0;
    const double constant =
        white_dn_per_s * 3.14159 * kLampDistance_mm * kLampDistance_mm / std::cos(0.785);
    for (const devices::LightChannel& channel : rig_.light.channels()) {
      expected.light.channels.push_back({channel.name, brdf::Rgb::Constant(constant / 3.0)});
    }
    expected.sample.brdf = [brdf](std::size_t, const brdf::DirectionPair&) -> brdf::Rgb {
      return brdf::Rgb::Constant(brdf);
    };
    expected.sample.source = "a test";
    return expected;
  }
  int moves() const {
    int sum = 0;
    for (const auto& stage : rig_.stages) sum += stage->moves + stage->homings;
    return sum;
  }

  FakeRig rig_;
  SessionOptions options_;
  MeasurementPlan plan_ = rig_.plan(kDirections);
};

TEST_F(PreflightOf, ListsWhatItLookedAtAndMovesNothing) {
  const Expectation expected = expectation(50000.0, 0.3);
  const Preflight found = look(&expected);
  EXPECT_EQ(found.refusal(), nullptr);
  for (const char* name : {"options", "instrument", "devices", "points", "camera", "light", "white",
                           "path", "turns", "approach", "view", "exposure", "drift"}) {
    EXPECT_NE(check(found, name).result, CheckResult::refuse) << name;
  }
  ASSERT_TRUE(found.itinerary);
  ASSERT_TRUE(found.forecast);
  EXPECT_EQ(found.forecast->points.size(), 3U);
  EXPECT_EQ(moves(), 0);
  EXPECT_TRUE(rig_.camera.exposures.empty());
}

TEST_F(PreflightOf, GoesOnLookingAfterARefusal) {
  rig_.known.camera.width_px = 64;
  options_.first_exposure = std::chrono::nanoseconds(0);
  const Preflight found = look();
  EXPECT_EQ(check(found, "options").result, CheckResult::refuse);
  EXPECT_EQ(check(found, "instrument").result, CheckResult::pass);
  ASSERT_NE(found.refusal(), nullptr);
  EXPECT_EQ(found.refusal()->name, "options");
}

TEST_F(PreflightOf, ShowsHowFarTheAxesGoOvershootsIncluded) {
  const Preflight straight = look();
  for (rig::Axis& axis : rig_.known.rig.axes) {
    axis.approach_overshoot = Angle::from_degrees(2.0);
  }
  const Preflight with = look();
  ASSERT_EQ(with.axes.size(), 3U);
  bool lower = false;
  for (std::size_t k = 0; k < with.axes.size(); ++k) {
    EXPECT_GE(with.axes[k].travelled, straight.axes[k].travelled);
    EXPECT_LE(with.axes[k].lowest, straight.axes[k].lowest);
    lower = lower || with.axes[k].lowest < straight.axes[k].lowest;
  }
  EXPECT_TRUE(lower);
  EXPECT_EQ(check(straight, "approach").result, CheckResult::note);
  EXPECT_EQ(check(with, "approach").result, CheckResult::pass);
}

TEST_F(PreflightOf, SaysThatAnAxisCanTurnOnceRound) {
  EXPECT_EQ(check(look(), "turns").result, CheckResult::pass);
  rig_.known.rig.axes[1].min = Angle::from_degrees(-200.0);
  rig_.known.rig.axes[1].max = Angle::from_degrees(200.0);
  rig_.stages[1] = std::make_unique<FakeStage>(rig_.known.rig.axes[1]);
  const Check turns = check(look(), "turns");
  EXPECT_EQ(turns.result, CheckResult::note);
  EXPECT_THAT(turns.text, HasSubstr("azimuth"));
}

TEST_F(PreflightOf, ForeseesWhatNoExposureCanMend) {
  const Expectation dim = expectation(50000.0, 1e-6);
  EXPECT_EQ(check(look(&dim), "exposure").result, CheckResult::note);
  EXPECT_THAT(check(look(&dim), "exposure").text, HasSubstr("3 of 3 points stay above"));
  const Expectation bright = expectation(1e9, 30.0);
  EXPECT_THAT(check(look(&bright), "exposure").text, HasSubstr("3 of 3 points saturate"));
  const Expectation good = expectation(50000.0, 0.3);
  EXPECT_EQ(check(look(&good), "exposure").result, CheckResult::pass);
}

TEST_F(PreflightOf, ForeseesLongerExposuresForAFinerSigma) {
  const Expectation expected = expectation(50000.0, 0.05);
  const double coarse_s = look(&expected).forecast->total_s.expected;
  options_.relative_sigma /= 4.0;
  EXPECT_GT(look(&expected).forecast->total_s.expected, coarse_s);
}

TEST_F(PreflightOf, GivesAWiderIntervalToWhatIsLessKnown) {
  Expectation expected = expectation(50000.0, 0.1);
  expected.sample.sigma_ln = 0.1;
  const Estimate known = look(&expected).forecast->total_s;
  expected.sample.sigma_ln = 1.0;
  const Estimate unknown = look(&expected).forecast->total_s;
  // What is less known is begun with shorter exposures.
  EXPECT_NEAR(unknown.expected, known.expected, 0.05 * known.expected);
  EXPECT_GT(unknown.high - unknown.low, 1.5 * (known.high - known.low));
  EXPECT_LE(known.low, known.expected);
  EXPECT_GE(known.high, known.expected);
}

TEST_F(PreflightOf, HasPartsThatAddUp) {
  const Expectation expected = expectation(50000.0, 0.1);
  const Forecast forecast = *look(&expected).forecast;
  double sum = 0.0;
  for (const Forecast::Part& part : forecast.parts) sum += part.seconds.expected;
  EXPECT_NEAR(forecast.total_s.expected, sum, 1e-9);
  int frames = options_.dark_frames;
  for (const ForecastPoint& point : forecast.points) frames += point.frames;
  EXPECT_GT(forecast.frames, frames) << "and the whites";
}

TEST(Disk, RefusesWhenLessIsFreeThanExpected) {
  EXPECT_EQ(check_disk({100, 200, 300}, "x").result, CheckResult::pass);
  EXPECT_EQ(check_disk({100, 200, 150}, "x").result, CheckResult::note);
  EXPECT_EQ(check_disk({100, 200, 50}, "x").result, CheckResult::refuse);
}

TEST(Disk, LooksAboveAFolderThatIsNotThereYet) {
  const TemporaryFolder folder;
  devices::CameraInfo camera;
  camera.width_px = 1000;
  camera.height_px = 1000;
  const DiskUse use = disk_use(camera, 10, 20, folder.path() / "not" / "yet");
  EXPECT_GE(use.needed_bytes, 20'000'000U);
  EXPECT_GT(use.needed_high_bytes, use.needed_bytes);
  EXPECT_GT(use.free_bytes, 0U);
}

TEST(Disk, SetsSpaceAsideAndGivesItBack) {
  const TemporaryFolder folder;
  std::filesystem::create_directory(folder.path() / "frames");
  const std::filesystem::path file = disk_reserve_file(folder.path());
  {
    DiskReserve reserve(folder.path(), 3'000'000);
    if (reserve.held_bytes() == 0) GTEST_SKIP() << "this file system sets nothing aside";
    EXPECT_EQ(std::filesystem::file_size(file), 3'000'000U);
    reserve.keep(1'000'000);
    EXPECT_EQ(std::filesystem::file_size(file), 1'000'000U);
    reserve.keep(2'000'000);
    EXPECT_EQ(reserve.held_bytes(), 1'000'000U) << "nothing is taken again";
  }
  EXPECT_FALSE(std::filesystem::exists(file));
}

TEST(Disk, CannotSetAsideMoreThanThereIs) {
  const TemporaryFolder folder;
  std::filesystem::create_directory(folder.path() / "frames");
  const auto free = std::filesystem::space(folder.path()).available;
  try {
    const DiskReserve reserve(folder.path(), 2 * free + 1'000'000);
    EXPECT_EQ(reserve.held_bytes(), 0U) << "a file system that sets nothing aside";
  } catch (const FileError& error) {
    EXPECT_THAT(error.what(), HasSubstr("reserve"));
  }
  EXPECT_FALSE(std::filesystem::exists(disk_reserve_file(folder.path())));
}

}  // namespace
}  // namespace gonio::acquisition
