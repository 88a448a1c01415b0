#include "gonio/acquisition/reduction.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <optional>
#include <utility>
#include <vector>

#include "fake_rig.h"
#include "gonio/errors/errors.h"
#include "temporary_folder.h"

namespace gonio::acquisition {
namespace {

using namespace gonio::literals;
using testing::HasSubstr;

/// An archive whose pixels come from a few lines of arithmetic, with no code of the reduction.
/// Lamp arm 2 a, sample turned a: light and camera mirror each other about the normal, so at the
/// centre theta_i = theta_o = a. At finite distance only the centre pixel is known by hand.
class Reduction : public testing::Test {
 protected:
  Reduction() {
    rig_.known.camera.fx_px = 700.0;  // 0.5 mm per pixel, 16 mm in view
    rig_.known.camera.fy_px = 700.0;
  }

  static constexpr double kWhiteAtCentre_dn_per_s = 20000.0;

  void write_frame(SessionWriter& archive, FrameKind kind, int point, const std::string& channel,
                   const rig::Joints& joints, double dn_per_s, double exposure_s) {
    devices::Frame frame;
    frame.width_px = 32;
    frame.height_px = 32;
    frame.saturation_level_dn = camera_full_dn_;
    frame.black_level_dn = 64.0;
    frame.exposure = std::chrono::nanoseconds(std::llround(exposure_s * 1e9));
    frame.frame_id = ++frame_id_;
    const double signal_dn = dn_per_s * (exposure_s + really_longer_s_);
    const double bent_dn = signal_dn * (1.0 - bend_ * std::pow(signal_dn / 4031.0, 2));
    frame.pixels_dn.assign(32 * 32, static_cast<std::uint16_t>(
                                        std::min<double>(camera_full_dn_, 64.0 + bent_dn + 0.5)));
    for (const auto& [column, row] : defective_) {
      frame.pixels_dn[static_cast<std::size_t>(32 * row + column)] = defective_dn_;
    }
    FrameRecord record;
    record.kind = kind;
    record.point = point;
    record.channel = channel;
    record.joints = joints;
    record.joints_spread.assign(3, Angle());
    record.monitor = channel.empty() || channel == blind_channel_ ? 0.0 : monitor_;
    archive.append(record, frame);
  }

  /// White at theta_i = 30; then the sample at theta_i = 60 with `ratio` times the white's signal.
  void write_session(double ratio) {
    SessionWriter archive(folder_, {}, {});
    for (int i = 0; i < 4; ++i) {
      write_frame(archive, FrameKind::dark, -1, "", kWhite, 0.0, 1e-4);
    }
    for (const char* channel : {"R", "G", "B"}) {
      write_frame(archive, FrameKind::white, -1, channel, kWhite, kWhiteAtCentre_dn_per_s, 0.1);
    }
    write_frame(archive, FrameKind::lamp_off, -1, "", kWhite, 0.0, 0.1);
    monitor_ = monitor_at_sample_;
    for (const char* channel : {"R", "G", "B"}) {
      write_frame(archive, FrameKind::sample, 0, channel, kSample, ratio * kWhiteAtCentre_dn_per_s,
                  sample_exposure_s_);
    }
    write_frame(archive, FrameKind::lamp_off, 0, "", kSample, 0.0, sample_exposure_s_);
    write_point(archive, 0, outcome_);
    if (!closing_white_) return;
    for (const char* channel : {"R", "G", "B"}) {
      write_frame(archive, FrameKind::white, -1, channel, kWhite,
                  *closing_white_ * kWhiteAtCentre_dn_per_s, 0.1);
    }
    write_frame(archive, FrameKind::lamp_off, -1, "", kWhite, 0.0, 0.1);
  }

  static void write_point(SessionWriter& archive, int point, PointOutcome outcome) {
    PointRecord record;
    record.point = point;
    record.outcome = outcome;
    archive.append(record);
  }

  gonio::acquisition::Reduction reduce_centre() {
    ReductionOptions options;
    options.grid = 1;
    options.spot_half_width_mm = 3.0;
    // White over the same few pixels, so that the flat frame of this test is nearly true there.
    options.sample_half_width_mm = 5.5;
    options.edge_margin_mm = 2.0;
    options.white_half_width_mm = white_half_width_mm_;
    return reduce(SessionReader(folder_), rig_.known, options);
  }
  std::string refusal() {
    try {
      reduce_centre();
    } catch (const DataFormatError& error) {
      return error.what();
    }
    return "reduced";
  }

  const rig::Joints kWhite{60_deg, 30_deg, 0_deg};
  const rig::Joints kSample{120_deg, 60_deg, 0_deg};
  TemporaryFolder temporary_;
  std::filesystem::path folder_ = temporary_.path() / "session";
  FakeRig rig_;
  std::uint64_t frame_id_ = 0;
  PointOutcome outcome_ = PointOutcome::Measured;
  std::optional<double> white_half_width_mm_;
  std::uint16_t camera_full_dn_ = 4095;
  double monitor_ = 1.0;
  std::string blind_channel_;  ///< that the monitor does not see
  double monitor_at_sample_ = 1.0;
  double sample_exposure_s_ = 0.1;
  double really_longer_s_ = 0.0;  ///< that light falls
  double bend_ = 0.0;             ///< share that a full signal loses
  std::vector<std::pair<int, int>> defective_;
  std::uint16_t defective_dn_ = 0;
  std::optional<double> closing_white_;  ///< over the opening one
};

TEST_F(Reduction, FindsTheBrdfThatTheSignalsSayByHand) {
  write_session(0.25);
  const auto reduced = reduce_centre();
  ASSERT_EQ(reduced.samples.samples.size(), 1U);
  const samples::Sample& sample = reduced.samples.samples[0];
  // f = f_w (S_s / S_w) (cos 30 / cos 60) = 1/pi * 0.25 * 1.7320508; r is 500 mm both times. Over
  // +-3.5 mm the flat frame deviates from a true one by second order terms only.
  const double expected = 0.25 * std::numbers::sqrt3 / std::numbers::pi;
  constexpr double kSecondOrder = 2e-3;
  for (int c = 0; c < 3; ++c) {
    EXPECT_NEAR(sample.value_per_sr[c] / expected, 1.0, kSecondOrder);
  }
  EXPECT_NEAR(sample.direction.theta_d.degrees(), 60.0, 0.02);
  EXPECT_NEAR(sample.direction.theta_h.degrees(), 0.0, 0.05);
  EXPECT_EQ(sample.pose, 0);
}

TEST_F(Reduction, TakesTheLampMonitorIntoAccount) {
  monitor_at_sample_ = 1.25;
  write_session(0.25);
  const double expected = 0.25 * std::numbers::sqrt3 / std::numbers::pi / 1.25;
  EXPECT_NEAR(reduce_centre().samples.samples[0].value_per_sr[1] / expected, 1.0, 2e-3);
}

TEST_F(Reduction, NeedsNoLampMonitor) {
  monitor_ = monitor_at_sample_ = 0.0;
  write_session(0.25);
  const double expected = 0.25 * std::numbers::sqrt3 / std::numbers::pi;
  EXPECT_NEAR(reduce_centre().samples.samples[0].value_per_sr[1] / expected, 1.0, 2e-3);
}

TEST_F(Reduction, NeedsNoMonitorInAChannelItDoesNotSee) {
  blind_channel_ = "B";
  monitor_ = monitor_at_sample_ = 50.0;
  write_session(0.25);
  const double expected = 0.25 * std::numbers::sqrt3 / std::numbers::pi;
  const brdf::Rgb value = reduce_centre().samples.samples[0].value_per_sr;
  EXPECT_NEAR(value[1] / expected, 1.0, 2e-3);
  EXPECT_NEAR(value[2] / expected, 1.0, 2e-3);
}

TEST_F(Reduction, LeavesOutAPointAtWhichTheLampMonitorReadsNothing) {
  monitor_ = 50.0;  // its own unit: a reading of 0 taken for 1 would be off by as much
  monitor_at_sample_ = 0.0;
  write_session(0.25);
  EXPECT_THAT(refusal(), HasSubstr("no usable point"));
}

TEST_F(Reduction, NeedsTheLampMonitorAtTheWhiteIfItReadsElsewhere) {
  monitor_ = 0.0;
  monitor_at_sample_ = 50.0;
  write_session(0.25);
  EXPECT_THAT(refusal(), HasSubstr("white frames"));
}

TEST_F(Reduction, UsesTheOtherWhiteWhenTheMonitorFailedAtOneAndSaysSo) {
  monitor_ = 0.0;
  monitor_at_sample_ = 1.0;  // the closing white's too
  closing_white_ = 1.0;
  write_session(0.25);
  const auto reduced = reduce_centre();
  EXPECT_EQ(reduced.samples.samples.size(), 1U);
  ASSERT_EQ(reduced.warnings.size(), 1U);
  EXPECT_THAT(reduced.warnings[0], HasSubstr("lamp monitor"));
}

TEST_F(Reduction, WarnsOfADriftOfTheWhite) {
  closing_white_ = 0.65;
  write_session(0.25);
  const auto reduced = reduce_centre();
  ASSERT_TRUE(reduced.white_drift_relative);
  EXPECT_NEAR(*reduced.white_drift_relative, -0.35, 1e-3);
  ASSERT_EQ(reduced.warnings.size(), 1U);
  EXPECT_THAT(reduced.warnings[0], HasSubstr("-35.0 %"));
}

TEST_F(Reduction, IsSilentAboutTheDriftOfAWarmLamp) {
  closing_white_ = 0.99;
  write_session(0.25);
  EXPECT_TRUE(reduce_centre().warnings.empty());
}

TEST_F(Reduction, ReadsTheWhiteOverItsOwnWidth) {
  white_half_width_mm_ = 2.5;
  write_session(0.25);
  // A white read over half a millimetre about its centre is what the arithmetic above is exact for.
  const double expected = 0.25 * std::numbers::sqrt3 / std::numbers::pi;
  const auto narrow = reduce_centre().samples.samples[0].value_per_sr[1];
  white_half_width_mm_.reset();
  const auto wide = reduce_centre().samples.samples[0].value_per_sr[1];
  EXPECT_NE(narrow, wide);
  EXPECT_NEAR(narrow / expected, 1.0, 2e-3);
}

TEST_F(Reduction, SaysHowUncertainTheWhiteMakesEverySampleOfAPose) {
  rig_.known.white.u_relative = 0.02;
  write_session(0.25);
  const samples::Sample sample = reduce_centre().samples.samples[0];
  EXPECT_NEAR(sample.u_common_per_sr[0] / sample.value_per_sr[0], 0.02, 1e-3);
  EXPECT_LT(sample.sigma_per_sr[0], 0.01 * sample.value_per_sr[0]);
}

TEST_F(Reduction, SaysHowUncertainTheSensorsCurveMakesASample) {
  rig_.known.white.u_relative = 0.0;
  rig_.known.u_linearity_relative = 0.004;
  write_session(0.25);
  const samples::Sample sample = reduce_centre().samples.samples[0];
  EXPECT_NEAR(sample.u_common_per_sr[1] / sample.value_per_sr[1], 0.004, 1e-3);
}

TEST_F(Reduction, TakesStrayLightOff) {
  rig_.known.stray = {0.01, 0.002};
  rig_.known.white.u_relative = 0.0;
  rig_.known.u_lamp_relative = 0.0;
  write_session(0.25);
  const samples::Sample sample = reduce_centre().samples.samples[0];
  // White: C (cos 30 + 0.01); sample: C (pi f cos 60 + 0.01), a quarter of it.
  const double expected = (0.25 * (0.5 * std::numbers::sqrt3 + 0.01) - 0.01) / 0.5;
  EXPECT_NEAR(std::numbers::pi * sample.value_per_sr[0] / expected, 1.0, 2e-3);
  EXPECT_NEAR(std::numbers::pi * sample.u_common_per_sr[0], 0.002 / 0.5, 1e-4);
}

TEST_F(Reduction, IsNotBentByASensorWhoseResponseIsKnown) {
  // The sample shows twice the white's signal: 4000 DN to 2000 DN of 4031.
  bend_ = 0.05;
  write_session(2.0);
  const double expected = 2.0 * std::numbers::sqrt3 / std::numbers::pi;
  EXPECT_LT(reduce_centre().samples.samples[0].value_per_sr[1] / expected, 0.97) << "not known";
  // linear = m (1 + c1 u + c2 u^2) through both levels: m = 3803.05 and 1975.38 DN by hand.
  const double m1 = 1975.38 / 4031.0;
  const double m2 = 3803.05 / 4031.0;
  const double a1 = (2000.0 / 1975.38 - 1.0) / m1;  // c1 + c2 m1
  const double a2 = (4000.0 / 3803.05 - 1.0) / m2;
  const double c2 = (a2 - a1) / (m2 - m1);
  rig_.known.sensor.response = {4031.0, a1 - c2 * m1, c2};
  EXPECT_NEAR(reduce_centre().samples.samples[0].value_per_sr[1] / expected, 1.0, 2e-3);
}

TEST_F(Reduction, KnowsHowMuchLongerLightFallsInAShortExposure) {
  really_longer_s_ = 1e-4;
  sample_exposure_s_ = 1e-3;  // 10 % more light than it says; the white's 0.1 s are 0.1 %
  write_session(20.0);
  const double expected = 20.0 * std::numbers::sqrt3 / std::numbers::pi;
  EXPECT_GT(reduce_centre().samples.samples[0].value_per_sr[1] / expected, 1.05) << "not known";
  rig_.known.sensor.shutter_offset_s = 1e-4;
  // Rounding of 440 DN: 0.1 %.
  EXPECT_NEAR(reduce_centre().samples.samples[0].value_per_sr[1] / expected, 1.0, 3e-3);
}

TEST_F(Reduction, RefusesAnExposureThatTheShutterOffsetLeavesNothingOf) {
  sample_exposure_s_ = 5e-4;
  write_session(0.25);
  rig_.known.sensor.shutter_offset_s = -5e-4;
  EXPECT_THAT(refusal(), HasSubstr("exposure: found 500 us, expected more than the 500 us"));
}

TEST_F(Reduction, IsNotBiasedByBadPixelsInThePatch) {
  const double expected = 0.25 * std::numbers::sqrt3 / std::numbers::pi;
  for (const auto& [column, row] : defective_ = {{16, 16}, {14, 17}, {15, 12}}) {
    rig_.known.sensor.bad_pixels.push_back({column, row});
  }
  // Three of about 70 pixels: dead, hot by a few hundred DN, full. As pixels that are clipped or
  // saturated they would take the whole spot with them.
  for (const int dn : {0, 900, 4095}) {
    folder_ = temporary_.path() / std::to_string(dn);
    defective_dn_ = static_cast<std::uint16_t>(dn);
    write_session(0.25);
    EXPECT_NEAR(reduce_centre().samples.samples.at(0).value_per_sr[1] / expected, 1.0, 2e-3) << dn;
  }
}

TEST_F(Reduction, DropsASpotThatBadPixelsLeaveLittleOf) {
  for (int row = 10; row < 18; ++row) {
    for (int column = 12; column < 20; ++column) {
      rig_.known.sensor.bad_pixels.push_back({column, row});
    }
  }
  write_session(0.25);
  EXPECT_THAT(refusal(), HasSubstr("found no usable point"));
}

TEST_F(Reduction, GivesNoValueToASaturatedSpot) {
  write_session(100.0);
  EXPECT_THROW(
      {
        try {
          reduce_centre();
        } catch (const DataFormatError& error) {
          EXPECT_THAT(error.what(), HasSubstr("no usable point"));
          throw;
        }
      },
      DataFormatError);
}

TEST_F(Reduction, GivesNoValueWhereTheCameraSaysItIsFull) {
  camera_full_dn_ = 1620;  // the calibration says 4095, the white would be 2064 DN
  write_session(0.25);
  try {
    reduce_centre();
    FAIL() << "reduced with a saturated white";
  } catch (const DataFormatError& error) {
    EXPECT_THAT(error.what(), HasSubstr("white frames"));
  }
}

TEST_F(Reduction, KeepsADarkValueAndMarksIt) {
  write_session(0.0);
  const samples::Sample sample = reduce_centre().samples.samples[0];
  EXPECT_THAT(sample.flags, HasSubstr("dark"));
  EXPECT_GT(sample.sigma_per_sr[0], 0.0);
}

TEST_F(Reduction, RefusesAnArchiveWithoutAWhite) {
  {
    SessionWriter archive(folder_, {}, {});
    for (const char* channel : {"R", "G", "B"}) {
      write_frame(archive, FrameKind::sample, 0, channel, kSample, 1000.0, 0.1);
    }
  }
  try {
    reduce_centre();
    FAIL() << "reduced without a white";
  } catch (const DataFormatError& error) {
    EXPECT_THAT(error.what(), HasSubstr("white frames"));
  }
}

TEST_F(Reduction, UsesOnlyPointsThatEndedAsMeasured) {
  outcome_ = PointOutcome::Saturated;
  write_session(0.25);
  EXPECT_THROW(reduce_centre(), DataFormatError);
}

TEST_F(Reduction, RefusesTheCalibrationOfAnotherCamera) {
  write_session(0.25);
  rig_.known.camera.width_px = 64;
  try {
    reduce_centre();
    FAIL() << "reduced with another camera's calibration";
  } catch (const DataFormatError& error) {
    EXPECT_THAT(error.what(), HasSubstr("found 32 x 32 px, the calibration is for 64 x 32 px"));
  }
}

TEST_F(Reduction, LeavesOutASpotBeyondAllPixels) {  // and under sanitizers counts none of them
  rig_.known.camera.fx_px = rig_.known.camera.fy_px = 1e15;
  write_session(0.25);
  EXPECT_THAT(refusal(), HasSubstr("found no usable point"));
}

TEST_F(Reduction, LeavesOutAPointWhoseChannelsAreNotAllThere) {
  {
    SessionWriter archive(folder_, {}, {});
    for (const char* channel : {"R", "G", "B"}) {
      write_frame(archive, FrameKind::white, -1, channel, kWhite, kWhiteAtCentre_dn_per_s, 0.1);
    }
    for (const char* channel : {"R", "G", "B"}) {
      write_frame(archive, FrameKind::sample, 0, channel, kSample, 9000.0, 0.1);
    }
    write_frame(archive, FrameKind::lamp_off, 0, "", kSample, 0.0, 0.1);
    write_frame(archive, FrameKind::sample, 1, "R", kSample, 9000.0, 0.1);
    write_point(archive, 0, PointOutcome::Measured);
    write_point(archive, 1, PointOutcome::Measured);
  }
  const auto reduced = reduce_centre();
  EXPECT_EQ(reduced.samples.samples.size(), 1U);
  ASSERT_FALSE(reduced.warnings.empty());
  EXPECT_THAT(reduced.warnings[0], HasSubstr("point 1: 1 of 3 channels"));
}

}  // namespace
}  // namespace gonio::acquisition
