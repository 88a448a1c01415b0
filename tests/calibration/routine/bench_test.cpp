// What is made of a picture in which some pixels have no value.

#include "bench.h"

#include <gtest/gtest.h>

#include <cmath>

#include "hidden_bench.h"
#include "look.h"

namespace gonio::calibration::routine {
namespace {

/// A bench whose instrument knows one bad pixel.
class BenchOnPictures : public ::testing::Test {
 protected:
  BenchOnPictures() {
    known_.sensor.bad_pixels = {{kBadColumn, kBadRow}};
    known_.sensor.response = {};
  }

  static constexpr int kBadColumn = 306;
  static constexpr int kBadRow = 257;

  Picture even(float signal_dn) const {
    Picture picture;
    picture.width_px = known_.camera.width_px;
    picture.height_px = known_.camera.height_px;
    picture.exposure_s = 0.01;
    const auto pixels = static_cast<std::size_t>(picture.width_px * picture.height_px);
    picture.signal_dn.assign(pixels, signal_dn);
    picture.saturated.assign(pixels, 0);
    return picture;
  }

  std::size_t index(int row, int column) const {
    return static_cast<std::size_t>(row * known_.camera.width_px + column);
  }

  static rig::Joints facing(const Bench& bench) {
    return bench.joints(Angle::from_degrees(45.0), {}, {});
  }

  instrument::Instrument known_ = test::HiddenBench::nominal(sim::HiddenImage::small);
  RoutineSettings settings_;
  test::HiddenBench hidden_{5};
  acquisition::GuardedDevices devices_{
      hidden_.devices,
      known_.rig,
      settings_.session,
      [](std::chrono::nanoseconds, const std::string&, const std::string&) {},
      {}};
};

TEST_F(BenchOnPictures, LeavesBadAndSingleSaturatedPixelsOutOfAMean) {
  const Bench bench(devices_, known_, settings_, {});
  Picture picture = even(1000.0F);
  picture.signal_dn[index(kBadRow, kBadColumn)] = 20.0F;
  picture.signal_dn[index(250, 300)] = 4031.0F;  // hot, and in no map
  picture.saturated[index(250, 300)] = 1;
  const auto mean = bench.signal_at(picture, facing(bench), {0.0, 0.0}, 4.0);
  EXPECT_NEAR(mean.value().dn_per_s, 1000.0 / (0.01 + known_.sensor.shutter_offset_s), 1e-3);
}

TEST_F(BenchOnPictures, CountsSaturatedPixelsWhereThereAreManyAsABound) {
  const Bench bench(devices_, known_, settings_, {});
  Picture picture = even(4031.0F);
  std::fill(picture.saturated.begin(), picture.saturated.end(), std::uint8_t{1});
  const auto mean = bench.signal_at(picture, facing(bench), {0.0, 0.0}, 4.0);
  EXPECT_NEAR(mean.value().dn_per_s, 4031.0 / (0.01 + known_.sensor.shutter_offset_s), 1e-3);
}

TEST_F(BenchOnPictures, TakesItsNeighboursForABadPixelInTheLampsImage) {
  const auto light = [&](const instrument::Instrument& known, float bad_dn) {
    const Bench bench(devices_, known, settings_, {});
    Picture picture = even(0.0F);
    const Eigen::Vector2d middle(305.0, 256.0);
    for (int row = 240; row < 273; ++row) {
      for (int column = 289; column < 322; ++column) {
        const double distance = (Eigen::Vector2d(column, row) - middle).norm();
        picture.signal_dn[index(row, column)] =
            static_cast<float>(2000.0 * std::exp(-distance * distance / 18.0));
      }
    }
    if (bad_dn > 0.0F) picture.signal_dn[index(kBadRow, kBadColumn)] = bad_dn;
    return bench.light_within(picture, middle, 10.0);
  };
  instrument::Instrument sound = known_;
  sound.sensor.bad_pixels.clear();
  const double whole = light(sound, 0.0F);
  EXPECT_NEAR(light(known_, 4000.0F), light(known_, 1.0F), 1e-9 * whole) << "whatever it holds";
  // The pixel holds 1.6 % of the light, a mean of its neighbours a tenth less than it.
  EXPECT_NEAR(light(known_, 4000.0F) / whole, 1.0, 0.003);
}

TEST(LookAtDarks, TakesTwoExposuresOfACameraThatCannotExposeForLong) {
  sim::SimOptions options = test::HiddenBench::options_with_board(5, sim::HiddenImage::small);
  options.camera.max_exposure = std::chrono::milliseconds(400);
  test::HiddenBench hidden(options);
  const instrument::Instrument known = test::HiddenBench::nominal(sim::HiddenImage::small);
  const RoutineSettings settings;
  acquisition::GuardedDevices devices(
      hidden.devices, known.rig, settings.session,
      [](std::chrono::nanoseconds, const std::string&, const std::string&) {}, {});
  Bench bench(devices, known, settings, [](const std::string&, double) {});
  const Observations seen = look_at_darks(bench);
  EXPECT_NEAR(seen.darks.value().black_level_dn.value, 64.0, 1.0);
  EXPECT_GT(seen.defects.size(), 30U) << "hot ones that 0.4 s shows";
}

}  // namespace
}  // namespace gonio::calibration::routine
