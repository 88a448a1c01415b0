#include "ambient_watch.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <numeric>

namespace gonio::acquisition {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;

constexpr std::uint16_t kBlack_dn = 64;
constexpr int kPixels = 400;
constexpr double kDimmest_dn_per_s = 1000.0;

class AmbientWatchTest : public testing::Test {
 protected:
  AmbientWatchTest() {
    sensor_.black_level_dn = kBlack_dn;
    sensor_.gain_dn_per_e = 0.1;
    sensor_.read_noise_e = 5.0;
    sensor_.saturation_dn = 4095.0;
    sensor_.full_well_e = 40000.0;
    options_.relative_sigma = 0.01;
    regions_.emplace_back(kPixels);
    std::iota(regions_[0].begin(), regions_[0].end(), 0U);
    watch_.begin_darks();
    for (int i = 0; i < 4; ++i) watch_.add_dark(frame(0));
  }

  static devices::Frame frame(std::uint16_t above_black_dn) {
    devices::Frame frame;
    frame.width_px = kPixels;
    frame.height_px = 1;
    frame.exposure = std::chrono::seconds(1);
    frame.pixels_dn.assign(kPixels, static_cast<std::uint16_t>(kBlack_dn + above_black_dn));
    return frame;
  }
  std::string look(std::uint16_t above_black_dn, devices::Target target = devices::Target::sample) {
    return watch_.changed(frame(above_black_dn), target, regions_, kDimmest_dn_per_s);
  }

  instrument::SensorModel sensor_;
  SessionOptions options_;
  Regions regions_;
  std::vector<std::string> warnings_;
  AmbientWatch watch_{sensor_, options_,
                      [this](std::string text) { warnings_.push_back(std::move(text)); }};
};

TEST_F(AmbientWatchTest, TellsAStepOnce) {
  EXPECT_THAT(look(10), IsEmpty()) << "there is none before the first";
  EXPECT_THAT(look(10), IsEmpty());
  EXPECT_THAT(look(30), HasSubstr("brighter by 20"));
  EXPECT_THAT(look(30), IsEmpty());
  EXPECT_THAT(look(10), HasSubstr("darker by 20"));
}

TEST_F(AmbientWatchTest, ComparesWhiteWithWhiteAndSampleWithSample) {
  look(100, devices::Target::white);
  EXPECT_THAT(look(10), HasSubstr("darker")) << "there is nothing else to compare the first with";
  EXPECT_THAT(look(10), IsEmpty());
  EXPECT_THAT(look(100, devices::Target::white), IsEmpty());
  EXPECT_THAT(look(10), IsEmpty());
  EXPECT_THAT(look(120, devices::Target::white), HasSubstr("brighter by 20"));
}

TEST_F(AmbientWatchTest, LeavesWhatDoesNotMatterToTheWantedPrecision) {
  look(10);
  EXPECT_THAT(look(14), IsEmpty()) << "half of 1 % of 1000 DN/s";
  EXPECT_THAT(look(20), HasSubstr("brighter by 6"));
}

TEST_F(AmbientWatchTest, GivesUpWhereTheLightIsAnotherAtEveryPose) {
  look(10);
  int found = 0;
  for (int point = 0; point < 20; ++point) {
    const auto here = static_cast<std::uint16_t>(10 + 40 * (point % 2 + 1));
    if (!look(here).empty()) {
      ++found;
      EXPECT_THAT(look(here), IsEmpty()) << "measured again";
    }
  }
  EXPECT_EQ(found, 4);
  EXPECT_THAT(warnings_, testing::ElementsAre(HasSubstr("may differ by the pose")));
}

TEST_F(AmbientWatchTest, LooksAgainWhenTheLightWasSteadyForAWhile) {
  std::uint16_t level = 10;
  const auto step = [&] { return look(level = level == 10 ? 50 : 10); };
  look(level);
  for (int i = 0; i < 4; ++i) EXPECT_THAT(step(), HasSubstr("with the lamp off")) << i;
  EXPECT_THAT(warnings_, testing::SizeIs(1));
  for (int i = 0; i < 7; ++i) EXPECT_THAT(look(level), IsEmpty());
  EXPECT_THAT(step(), IsEmpty()) << "it was not steady for long enough";
  for (int i = 0; i < 8; ++i) {
    EXPECT_THAT(warnings_, testing::SizeIs(1)) << "after " << i;
    EXPECT_THAT(look(level), IsEmpty());
  }
  EXPECT_THAT(warnings_, testing::ElementsAre(testing::_, HasSubstr("is looked at again")));
  EXPECT_THAT(step(), HasSubstr("with the lamp off"));
}

TEST_F(AmbientWatchTest, DoesNotGiveUpForStepsNowAndThen) {
  look(10);
  for (int step = 0; step < 10; ++step) {
    const auto level = static_cast<std::uint16_t>(10 + 40 * (step % 2 + 1));
    EXPECT_THAT(look(level), HasSubstr("with the lamp off")) << step;
    for (int quiet = 0; quiet < 4; ++quiet) EXPECT_THAT(look(level), IsEmpty());
  }
}

}  // namespace
}  // namespace gonio::acquisition
