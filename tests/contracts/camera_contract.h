#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <functional>
#include <memory>
#include <numeric>
#include <ostream>
#include <string>

#include "gonio/devices/camera.h"
#include "gonio/devices/clock.h"
#include "throws_device_error.h"

/// What every Camera has to do; see rotation_stage_contract.h for the pattern.
namespace gonio::contracts {

/// A camera that looks at a bright plate under a lamp.
struct CameraUnderTest {
  std::shared_ptr<devices::Camera> camera;       ///< keeps its world alive
  std::shared_ptr<devices::Clock> clock;         ///< of the camera's time stamps
  std::function<void(bool)> set_light;           ///< the lamp; dark at first
  std::chrono::nanoseconds half_exposure;        ///< brings the lit plate near half saturation
  double black_tolerance_dn;                     ///< of the mean of a dark frame
  std::function<void(bool)> set_connected = {};  ///< cuts the link and mends it; none: it has none
};

struct CameraMaker {
  std::string name;
  std::function<CameraUnderTest()> make;

  friend std::ostream& operator<<(std::ostream& out, const CameraMaker& maker) {
    return out << maker.name;
  }
};

class CameraContract : public testing::TestWithParam<CameraMaker> {
 protected:
  CameraContract() : made_(GetParam().make()), camera_(*made_.camera) {}

  static double mean_dn(const devices::Frame& frame) {
    return std::accumulate(frame.pixels_dn.begin(), frame.pixels_dn.end(), 0.0) /
           static_cast<double>(frame.pixels_dn.size());
  }

  CameraUnderTest made_;
  devices::Camera& camera_;
};

TEST_P(CameraContract, SaysWhatItIs) {
  const devices::CameraInfo info = camera_.info();
  EXPECT_FALSE(camera_.name().empty());
  EXPECT_FALSE(info.model.empty());
  EXPECT_FALSE(info.serial.empty());
  EXPECT_GT(info.width_px, 0);
  EXPECT_GT(info.height_px, 0);
  EXPECT_GT(info.saturation_level_dn, 0);
  EXPECT_GT(info.min_exposure.count(), 0);
  EXPECT_LE(info.min_exposure, info.max_exposure);
  EXPECT_GE(info.readout.count(), 0);
}

TEST_P(CameraContract, FramesAreAsAnnounced) {
  const devices::CameraInfo info = camera_.info();
  const devices::Frame frame = camera_.capture(made_.half_exposure);
  EXPECT_EQ(frame.width_px, info.width_px);
  EXPECT_EQ(frame.height_px, info.height_px);
  EXPECT_EQ(frame.pixel_format, info.pixel_format);
  EXPECT_EQ(frame.saturation_level_dn, info.saturation_level_dn);
  EXPECT_EQ(frame.pixels_dn.size(),
            static_cast<std::size_t>(info.width_px) * static_cast<std::size_t>(info.height_px));
}

TEST_P(CameraContract, AppliedExposureIsCloseToTheOneAskedFor) {
  for (const auto exposure : {made_.half_exposure, 3 * made_.half_exposure}) {
    const auto applied = camera_.capture(exposure).exposure;
    EXPECT_NEAR(static_cast<double>(applied.count()), static_cast<double>(exposure.count()),
                0.02 * static_cast<double>(exposure.count()));
  }
}

TEST_P(CameraContract, TakesItsShortestExposure) {
  EXPECT_GE(camera_.capture(camera_.info().min_exposure).exposure, camera_.info().min_exposure);
}

TEST_P(CameraContract, RefusesExposuresOutsideItsRangeWithoutExposing) {
  const devices::CameraInfo info = camera_.info();
  const auto before = camera_.capture(made_.half_exposure).frame_id;
  for (const auto exposure : {info.min_exposure - std::chrono::nanoseconds(1),
                              info.max_exposure + std::chrono::nanoseconds(1),
                              std::chrono::nanoseconds(0), std::chrono::nanoseconds(-1)}) {
    EXPECT_THAT([&] { camera_.capture(exposure); },
                ThrowsDeviceError(devices::DeviceErrc::LimitViolation));
  }
  EXPECT_EQ(camera_.capture(made_.half_exposure).frame_id, before + 1);
}

TEST_P(CameraContract, FrameNumbersCountUpByOne) {
  const auto first = camera_.capture(made_.half_exposure).frame_id;
  EXPECT_EQ(camera_.capture(made_.half_exposure).frame_id, first + 1);
  EXPECT_EQ(camera_.capture(made_.half_exposure).frame_id, first + 2);
}

TEST_P(CameraContract, ExposuresLieBetweenCallAndReturnAndDoNotOverlap) {
  auto last_end = std::chrono::nanoseconds(0);
  for (int index = 0; index < 3; ++index) {
    const auto called = made_.clock->now();
    const devices::Frame frame = camera_.capture(made_.half_exposure);
    const auto end = frame.exposure_start + frame.exposure;
    EXPECT_GE(frame.exposure_start, called);
    EXPECT_LE(end, made_.clock->now());
    EXPECT_GE(frame.exposure_start, last_end);
    last_end = end;
  }
}

TEST_P(CameraContract, DarkFramesStandAtTheBlackLevel) {
  const devices::Frame frame = camera_.capture(made_.half_exposure);
  EXPECT_NEAR(mean_dn(frame), frame.black_level_dn, made_.black_tolerance_dn);
}

TEST_P(CameraContract, SignalGrowsWithTheExposure) {
  made_.set_light(true);
  const devices::Frame half = camera_.capture(made_.half_exposure / 2);
  const devices::Frame full = camera_.capture(made_.half_exposure);
  const double ratio =
      (mean_dn(full) - full.black_level_dn) / (mean_dn(half) - half.black_level_dn);
  EXPECT_NEAR(ratio, 2.0, 0.1);
}

TEST_P(CameraContract, FrameShowsThePresentAndNotThePast) {
  made_.set_light(true);
  const double lit = mean_dn(camera_.capture(made_.half_exposure));
  made_.set_light(false);
  const devices::Frame dark = camera_.capture(made_.half_exposure);
  made_.set_light(true);
  const double lit_again = mean_dn(camera_.capture(made_.half_exposure));
  EXPECT_NEAR(mean_dn(dark), dark.black_level_dn, made_.black_tolerance_dn);
  EXPECT_NEAR(lit_again / lit, 1.0, 0.05);
}

TEST_P(CameraContract, ReportsALostConnectionAndWorksAgainOverANewOne) {
  if (!made_.set_connected) GTEST_SKIP() << "nothing to cut";
  const devices::CameraInfo info = camera_.info();
  const devices::Frame before = camera_.capture(made_.half_exposure);
  made_.set_connected(false);
  EXPECT_THAT([&] { camera_.capture(made_.half_exposure); },
              ThrowsDeviceError(devices::DeviceErrc::Disconnected));
  EXPECT_EQ(camera_.info().serial, info.serial);
  made_.set_connected(true);
  const devices::Frame after = camera_.capture(made_.half_exposure);
  EXPECT_EQ(after.frame_id, before.frame_id + 1);
  EXPECT_EQ(after.exposure, before.exposure);
  EXPECT_EQ(after.black_level_dn, before.black_level_dn);
  EXPECT_EQ(after.gain_db, before.gain_db);
  EXPECT_GE(after.exposure_start, before.exposure_start + before.exposure);
}

TEST_P(CameraContract, ErrorsNameTheCamera) {
  try {
    camera_.capture(std::chrono::nanoseconds(0));
    FAIL() << "took a frame of no exposure";
  } catch (const devices::DeviceError& error) {
    EXPECT_EQ(error.device(), camera_.name());
  }
}

}  // namespace gonio::contracts
